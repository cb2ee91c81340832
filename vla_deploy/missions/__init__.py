"""Missions: several objectives, their order, their criteria, their times, and how far they are."""
