"""Group manipulation errors by what the caller can do.

ManipulationError
├── PostureUnreachable   stand elsewhere, or use the other hand
├── TooWide              no grasp fits: choose another object
└── NotFromSide          grasp it from above
"""


class ManipulationError(Exception):
    """Base of everything that manipulation raises."""


class TooWide(ManipulationError):
    """Say that an object does not fit between the fingers."""


class NotFromSide(ManipulationError):
    """Say why an object is not grasped from the side."""


class PostureUnreachable(ManipulationError):
    """Say that no posture within the limits brings the hand there."""

    def __init__(self, reason: str, position_error_m: float = 0.0) -> None:
        self.position_error_m = position_error_m
        super().__init__(reason)
