"""Emulate the home beside the robot: an MQTT broker, and the lamps and sockets on it."""
