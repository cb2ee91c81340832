"""Find what fails on the robot and why; raise alarms, and record who has acknowledged them."""
