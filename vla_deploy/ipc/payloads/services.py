"""Type how page, stop door, ROS gateway, devices of the home and twin are."""

from typing import Literal, TypedDict


class DashboardStatus(TypedDict):
    """Say where the page is, and how often each of its parts failed."""

    url: str
    port: int
    host: str
    failures: dict[str, int]


class StopDoorStatus(TypedDict):
    """Say where the stop door listens, why not, and how often it was used."""

    open: bool
    why: str
    host: str
    port: int
    scheme: str
    pressed: int
    joined: int
    failed: int
    refused: int
    connections: int
    accepted: int
    expired: int
    lost: int
    crowded_out: int


class RosStatus(TypedDict):
    """Say which graph the robot is in, what it accepts, and what it dropped."""

    node: str
    domain_id: int
    accept: Literal["off", "stop", "all"]
    simulated_time: bool
    dropped: int
    failures: dict[str, int]


class RosGoalAct(TypedDict):
    """Cancel a goal, or renew or take back the leave to drive for it; docs/ros.md."""

    act: Literal["cancel", "permit", "hold"]
    request_id: str
    reason: str


class DeviceStatus(TypedDict):
    """Say what is known of one device of the home; `is_on` is None where `fault` says why not.

    `age_s` is from its last reading, None before the first. `called` is its own name for itself.
    """

    name: str
    kind: str
    place: str
    called: str
    where: str
    is_on: bool | None
    age_s: float | None
    fault: str


class DevicesStatus(TypedDict):
    """Say what is known of every device of the home."""

    devices: list[DeviceStatus]


class TwinStatusDocument(TypedDict):
    """Say how simulated time goes; `held_by` has held it most."""

    pace: Literal["real", "fast", "wall"]
    simulated_ns: int
    real_time_factor: float
    held_by: str
