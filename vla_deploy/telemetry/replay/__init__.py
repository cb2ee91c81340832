"""Replay a recording or a flight: the topics of a run are fed from the file."""
