"""Send the robot's topics to browsers as they change."""
