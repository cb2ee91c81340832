"""Publish what the robot knows in the ROS graph."""
