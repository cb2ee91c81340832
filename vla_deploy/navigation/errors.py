"""Group navigation errors by what the caller can do.

NavigationError
└── NoPath       another goal, or clear the way
"""


class NavigationError(Exception):
    """Base of everything that navigation raises."""


class NoPath(NavigationError):
    """Say that no way with enough clearance leads to the goal."""
