"""Group navigation errors by what the caller can do.

NavigationError
├── NoPath       another goal, or clear the way
└── MapInvalid   mend the map's files
"""


class NavigationError(Exception):
    """Base of everything that navigation raises."""


class NoPath(NavigationError):
    """Say that no way with enough clearance leads to the goal."""


class MapInvalid(NavigationError):
    """Say what is wrong with a map file."""
