"""Run the robot's processes: start, watch, restart and stop them in order."""
