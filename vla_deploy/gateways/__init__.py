"""Let other systems reach the robot, each through a process of its own."""
