"""List every check of the doctor, and carry them out."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

from platforms.tree import Missing
from vla_deploy.doctor import (
    clocks,
    computer,
    devices,
    limits,
    power,
    realtime,
    software,
    storage,
)
from vla_deploy.doctor.context import Context
from vla_deploy.doctor.finding import Finding, missing

Examination = Callable[[Context], Iterator[Finding]]

CHECKS: tuple[tuple[str, str, Examination], ...] = (
    ("Computer", "board", computer.board),
    ("Computer", "profile", computer.profile),
    ("Computer", "memory", computer.memory),
    ("Devices", "device files", devices.device_files),
    ("Devices", "latency timers", devices.latency_timers),
    ("Devices", "CAN link", devices.can_link),
    ("Devices", "sound", devices.sound),
    ("Real time", "kernel", realtime.preempt_rt),
    ("Real time", "SCHED_FIFO", realtime.fifo),
    ("Real time", "real-time share", realtime.realtime_share),
    ("Real time", "RT_GROUP_SCHED", realtime.group_scheduling),
    ("Real time", "memory lock", realtime.memory_lock),
    ("Real time", "wake-up", realtime.wake_up),
    ("Limits", "control groups", limits.control_groups),
    ("Clocks", "clock source", clocks.clock_source),
    ("Clocks", "wall time", clocks.wall_time),
    ("Clocks", "jump since boot", clocks.jump_since_boot),
    ("Power", "temperature", power.heat),
    ("Power", "throttling", power.throttling),
    ("Power", "power mode", power.power_mode),
    ("Power", "CPU governor", power.governor),
    ("Power", "isolated CPUs", power.isolated_processors),
    ("Storage", "disk", storage.disks),
    ("Storage", "shared memory", storage.shared_memory),
    ("Storage", "swap", storage.swap),
    ("Software", "Python", software.python),
    ("Software", "packages", software.packages),
    ("Software", "models", software.models),
    ("Software", "OpenGL (EGL)", software.open_gl),
    ("Software", "ROS", software.ros),
    ("Software", "service", software.service),
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Section:
    """Hold the findings of one topic."""

    topic: str
    findings: tuple[Finding, ...]


def examine(context: Context) -> tuple[Section, ...]:
    """Carry out every check; what cannot be looked at is a finding of its own."""
    found: dict[str, list[Finding]] = {}
    for topic, name, check in CHECKS:
        found.setdefault(topic, []).extend(_findings(context, name, check))
    return tuple(Section(topic=topic, findings=tuple(rows)) for topic, rows in found.items())


def _findings(context: Context, name: str, check: Examination) -> list[Finding]:
    findings: list[Finding] = []
    try:
        findings.extend(check(context))
    except (Missing, OSError) as error:
        findings.append(missing(name, str(error)))
    return findings
