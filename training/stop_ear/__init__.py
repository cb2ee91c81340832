"""Teach a copy of the recogniser's encoder to listen for stop words alone."""
