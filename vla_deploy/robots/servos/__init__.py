"""Declare a robot's servos to their drivers, and judge what they hold and show."""
