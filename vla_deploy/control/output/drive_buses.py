"""Build the wheel drives' bus from the robot file: one row per protocol."""

from collections.abc import Callable, Mapping

import can

from drivers.canopen import EDS_PATH, DriveMode, DriveSpec, WheelDriveBus
from drivers.clock import Clock
from drivers.odrive import EMULATED_ENDPOINTS, AxisSpec, ODriveBus
from drivers.wheel_drives.bus import DriveBus
from platforms import Profile
from vla_deploy.robots.devices import CanBus


def _cia402(wiring: CanBus, profile: Profile, bus: can.BusABC, clock: Clock) -> DriveBus:
    drives = [
        DriveSpec(
            node_id=drive.node_id,
            joint=drive.joint,
            sign=drive.sign,
            counts_per_rev=drive.counts_per_rev,
            gear_ratio=drive.gear_ratio,
            mode=DriveMode[drive.mode.upper()],
        )
        for drive in wiring.drives
    ]
    return WheelDriveBus(
        bus,
        clock,
        drives,
        heartbeat_s=profile.can_heartbeat_s,
        eds_path=wiring.eds_path or EDS_PATH,
        cycle_s=1.0 / profile.control_rate_hz,
    )


def _odrive(wiring: CanBus, profile: Profile, bus: can.BusABC, clock: Clock) -> DriveBus:
    axes = [
        AxisSpec(
            node_id=drive.node_id,
            joint=drive.joint,
            sign=drive.sign,
            gear_ratio=drive.gear_ratio,
            current_limit_a=drive.current_limit_a,
        )
        for drive in wiring.drives
    ]
    return ODriveBus(
        bus,
        clock,
        axes,
        wiring.endpoints_path or EMULATED_ENDPOINTS,
        heartbeat_s=profile.can_heartbeat_s,
    )


PROTOCOLS: Mapping[str, Callable[[CanBus, Profile, can.BusABC, Clock], DriveBus]] = {
    "cia402": _cia402,
    "odrive": _odrive,
}


def drive_bus(wiring: CanBus, profile: Profile, bus: can.BusABC, clock: Clock) -> DriveBus:
    """Return the driver of the wheel drives; it takes over the opened bus."""
    return PROTOCOLS[wiring.protocol](wiring, profile, bus, clock)
