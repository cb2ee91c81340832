"""Take part in a ROS 2 graph: what the robot publishes, and what may be commanded from there."""
