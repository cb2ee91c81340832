"""Declare what the code of all families knows of a servo."""

from typing import Protocol


class BusServo(Protocol):
    """Name a servo by its id on the bus and by its joint; its text says both and the model."""

    @property
    def id(self) -> int:
        """Return the id on the bus."""
        ...

    @property
    def joint(self) -> str:
        """Return the joint that it drives."""
        ...
