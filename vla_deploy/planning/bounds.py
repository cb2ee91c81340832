"""Bound what people and programs may give the planner; no pydantic, as ROS has its own Python."""

from typing import Final

MOST_CHARACTERS: Final = 1000
"""Of one command in words."""
