"""Group manipulation errors by what the caller can do.

ManipulationError
├── Unreachable   stand elsewhere, or use the other hand
└── TooWide       no grasp fits: choose another object
"""


class ManipulationError(Exception):
    """Base of everything that manipulation raises."""


class TooWide(ManipulationError):
    """Say that an object does not fit between the fingers."""


class PostureUnreachable(ManipulationError):
    """Say that no posture within the limits brings the hand there."""

    def __init__(self, reason: str, *, position_error_m: float, rotation_error_rad: float) -> None:
        self.reason = reason
        self.position_error_m = position_error_m
        self.rotation_error_rad = rotation_error_rad
        super().__init__(reason)
