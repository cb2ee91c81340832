"""Speak the languages of model servers."""
