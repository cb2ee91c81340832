"""Tell the ROS graph what the robot knows."""
