"""Flights, recordings, replays, live viewers and metrics of the robot's processes."""
