"""Group manipulation errors by what the caller can do.

ManipulationError
├── Unreachable   stand elsewhere, or use the other hand
└── TooWide       no grasp fits: choose another object
"""


class ManipulationError(Exception):
    """Base of everything that manipulation raises."""


class TooWide(ManipulationError):
    """Say that an object does not fit between the fingers."""
