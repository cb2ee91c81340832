"""Connect other systems with the robot, each through a process of its own."""
