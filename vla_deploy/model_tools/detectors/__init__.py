"""Add, measure and quantise detectors."""
