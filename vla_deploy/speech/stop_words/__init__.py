"""Spot stop words on the stream, and press the stop button: no end of phrase, no recogniser."""
