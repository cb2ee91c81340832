"""Bound what people and programs may give the planner."""

from typing import Final

MOST_CHARACTERS: Final = 1000
"""Of one command in words."""
