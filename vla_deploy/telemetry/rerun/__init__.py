"""Recordings and runs in Rerun: the messages that viewers get, as its entities."""
