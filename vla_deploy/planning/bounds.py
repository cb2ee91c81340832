"""Bound what people and programs may give the planner, for ROS's Python, too: it has no pydantic."""

from typing import Final

MOST_CHARACTERS: Final = 1000
"""Of one command in words."""
