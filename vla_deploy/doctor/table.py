"""List every check of the doctor, and carry them out."""

import logging
from collections.abc import Callable, Iterator
from dataclasses import dataclass

from platforms.tree import ValueMissing
from vla_deploy.doctor import (
    computer,
    devices,
    home_devices,
    power,
    realtime,
    ros,
    servos,
    software,
)
from vla_deploy.doctor.context import DoctorContext
from vla_deploy.doctor.finding import DoctorFinding, Section, missing, warn

_log = logging.getLogger(__name__)
Examination = Callable[[DoctorContext], Iterator[DoctorFinding]]


@dataclass(frozen=True, slots=True)
class Check:
    """Name one check; those that are `live` look at this process or measure this computer."""

    topic: str
    name: str
    run: Examination
    live: bool = False


CHECKS: tuple[Check, ...] = (
    Check("Computer", "board", computer.board),
    Check("Computer", "profile", computer.profile),
    Check("Computer", "memory", computer.memory),
    Check("Computer", "user", computer.user, live=True),
    Check("Devices", "device files", devices.device_files),
    Check("Devices", "servo port", servos.port_users, live=True),
    Check("Devices", "servo bus", servos.servos_on_the_bus, live=True),
    Check("Devices", "servo guard", servos.servo_guard),
    Check("Devices", "camera calibration", devices.camera_calibration),
    Check("Devices", "latency timers", devices.latency_timers),
    Check("Devices", "CAN link", devices.can_link),
    Check("Devices", "sound", devices.sound),
    Check("Devices", "devices of the home", home_devices.reachable, live=True),
    Check("Devices", "spoken stop", devices.spoken_stop, live=True),
    Check("Real time", "kernel", realtime.preempt_rt),
    Check("Real time", "SCHED_FIFO", realtime.fifo, live=True),
    Check("Real time", "serial data", realtime.serial_data, live=True),
    Check("Real time", "real-time share", realtime.realtime_share),
    Check("Real time", "fair server", realtime.fair_server),
    Check("Real time", "RT_GROUP_SCHED", realtime.group_scheduling),
    Check("Real time", "memory lock", realtime.memory_lock, live=True),
    Check("Real time", "wake-up", realtime.wake_up, live=True),
    Check("Limits", "control groups", realtime.control_groups),
    Check("Clocks", "clock source", computer.clock_source),
    Check("Clocks", "wall time", computer.wall_time, live=True),
    Check("Clocks", "jump since boot", computer.jump_since_boot),
    Check("Power", "temperature", power.heat),
    Check("Power", "throttling", power.throttling),
    Check("Power", "power mode", power.power_mode),
    Check("Power", "CPU governor", power.governor),
    Check("Power", "battery", power.battery),
    Check("Power", "isolated CPUs", power.isolated_processors),
    Check("Storage", "disk", computer.disks, live=True),
    Check("Storage", "shared memory", computer.shared_memory, live=True),
    Check("Storage", "swap", computer.swap),
    Check("Software", "Python", software.python, live=True),
    Check("Software", "packages", software.packages, live=True),
    Check("Software", "models", software.models, live=True),
    Check("Software", "OpenGL (EGL)", software.open_gl, live=True),
    Check("Software", "service", software.service),
    Check("Software", "dashboard", software.dashboard, live=True),
    Check("ROS", "use", ros.usage),
    Check("ROS", "interpreter", ros.environment, live=True),
    Check("ROS", "DDS leftovers", ros.leftovers, live=True),
    Check("ROS", "ROS logs", ros.logs, live=True),
)


def examine(context: DoctorContext) -> tuple[Section, ...]:
    """Carry out every check; what cannot be looked at is a finding of its own."""
    found: dict[str, list[DoctorFinding]] = {}
    for check in CHECKS:
        found.setdefault(check.topic, []).extend(_findings(context, check))
    return tuple(Section(topic=topic, findings=tuple(rows)) for topic, rows in found.items())


def _findings(context: DoctorContext, check: Check) -> list[DoctorFinding]:
    if check.live and not context.is_live:
        return [missing(check.name, "to be examined on the computer itself")]
    findings: list[DoctorFinding] = []
    try:
        findings.extend(check.run(context))
    except (ValueMissing, OSError) as error:
        findings.append(missing(check.name, str(error)))
    except Exception as error:  # a check that breaks must not end the others
        _log.exception("the check %r broke", check.name)
        measured = f"the check itself broke: {type(error).__name__}: {error}"
        findings.append(warn(check.name, measured, "vla-deploy doctor --json   # and report it"))
    return findings
