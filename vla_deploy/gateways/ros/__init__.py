"""Take part in a ROS 2 graph: what the robot tells, and what may be commanded from there."""
