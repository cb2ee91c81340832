"""Declare what the cycle of a bus wants to know of each of its drives."""

from typing import Protocol

from drivers.wheel_drives.bus import DriveFault, PowerState


class DriveIdentity(Protocol):
    """Say which drive turns which joint."""

    @property
    def node_id(self) -> int:
        """Return the drive's address."""
        ...

    @property
    def joint(self) -> str:
        """Return the joint that it turns."""
        ...

    @property
    def name(self) -> str:
        """Return what it is called in messages."""
        ...


class CyclicPort(Protocol):
    """Hold what one drive has said."""

    @property
    def spec(self) -> DriveIdentity:
        """Return which drive it is."""
        ...

    @property
    def power_state(self) -> PowerState:
        """Return the drive's state."""
        ...

    @property
    def position_rad(self) -> float:
        """Return the joint's angle."""
        ...

    @property
    def velocity_rad_s(self) -> float:
        """Return the joint's speed."""
        ...

    @property
    def torque_nm(self) -> float:
        """Return the joint's torque, NaN where it is not told."""
        ...

    @property
    def faulted(self) -> bool:
        """Return whether the drive is in a fault state."""
        ...

    @property
    def fault(self) -> DriveFault | None:
        """Return its gravest complaint that was not taken back."""
        ...

    def age_s(self, now_ns: int) -> float:
        """Return the age of the values."""
        ...

    def lost(self, now_ns: int) -> bool:
        """Return whether the drive can no longer be driven."""
        ...
