"""Teach the recogniser's encoder to tell stop words by a head of its own."""
