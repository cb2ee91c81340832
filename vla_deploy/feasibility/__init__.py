"""Judge by measurement whether actions can be done, and what must be done before or instead.

It reads the world and plans, and has no way to the robot.
"""
