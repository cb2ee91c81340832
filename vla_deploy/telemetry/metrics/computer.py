"""Declare what is measured of the computer: each metric is a reading of the probes."""

from collections.abc import Iterator
from typing import Final

from vla_deploy.telemetry.metrics.kinds import Kind, Metric
from vla_deploy.telemetry.metrics.paths import Among, At, Each, keys

TOPIC: Final = "board"

# name, reading, unit, goes to the history, help
_ROWS: Final[tuple[tuple[str, str, str, bool, str], ...]] = (
    ("cpu_used_ratio", "cpu_ratio", "ratio", True, "Share of all cores that is busy."),
    ("cpu_frequency_hertz", "cpu_frequency_hz", "hertz", False, "Clock of the fastest cores."),
    ("memory_total_bytes", "memory_total_bytes", "bytes", False, "Memory of the computer."),
    (
        *("memory_available_bytes", "memory_available_bytes", "bytes", True),
        "Memory that programs can still get.",
    ),
    ("swap_used_bytes", "swap_used_bytes", "bytes", False, "Swap in use."),
    (
        *("gpu_memory_used_bytes", "gpu_memory_used_bytes", "bytes", True),
        "Memory that the GPU holds; on a Jetson it is part of the same memory.",
    ),
    ("gpu_load_ratio", "gpu_load_ratio", "ratio", True, "Share of time that the GPU is busy."),
    ("gpu_frequency_hertz", "gpu_frequency_hz", "hertz", False, "Clock of the GPU."),
    ("emc_load_ratio", "emc_load_ratio", "ratio", False, "Use of the memory bus."),
    ("power_watts", "power_w", "watts", True, "Power that the board takes."),
    (
        *("temperature_celsius", "temperature_c", "celsius", True),
        "Temperature of the hottest zone that can be read.",
    ),
    ("fan_rpm", "fan_rpm", "rpm", False, "Revolutions of the fan per minute."),
    ("fan_drive_ratio", "fan_drive_ratio", "ratio", False, "How hard the fan is driven."),
    ("power_mode", "power_mode_id", "", False, "Id of the power mode, as nvpmodel names it."),
    (
        *("disk_free_bytes", "disk_free_bytes", "bytes", True),
        "Room on the tightest of the disks that the robot writes to.",
    ),
    (
        *("disk_free_ratio", "disk_free_ratio", "ratio", False),
        "Share that is free of the tightest of the disks that the robot writes to.",
    ),
)

# name, what the names of the readings begin with, unit, label, help
_FAMILIES: Final[tuple[tuple[str, str, str, str, str], ...]] = (
    ("power_rail_watts", "power_w.", "watts", "rail", "Power of one rail of the board."),
    (
        *("zone_temperature_celsius", "temperature_c.", "celsius", "zone"),
        "Temperature of one thermal zone.",
    ),
    (
        *("throttle_events_total", "throttle_count.", "", "kind"),
        "Under-voltage (oc1), average (oc2) and instantaneous (oc3) over-current since boot.",
    ),
)


def _singles() -> Iterator[Metric]:
    for name, reading, unit, kept, text in _ROWS:
        yield Metric(
            name=f"vla_{name}",
            kind=Kind.GAUGE,
            unit=unit,
            help=text,
            topic=TOPIC,
            paths=((At(("readings", reading)),),),
            kept=kept,
        )


def _families() -> Iterator[Metric]:
    for name, prefix, unit, label, text in _FAMILIES:
        yield Metric(
            name=f"vla_{name}",
            kind=Kind.COUNTER if name.endswith("_total") else Kind.GAUGE,
            unit=unit,
            help=text,
            topic=TOPIC,
            paths=((keys("readings"), Each(label, prefix)),),
        )


METRICS: Final[tuple[Metric, ...]] = (
    *_singles(),
    *_families(),
    Metric(
        name="vla_pressure_ratio",
        kind=Kind.GAUGE,
        unit="ratio",
        help="Share of the last 10 s in which something waited for CPU, memory or disk.",
        topic=TOPIC,
        paths=(
            (
                keys("readings"),
                Among("resource", {name: f"psi_{name}_ratio" for name in ("cpu", "memory", "io")}),
            ),
        ),
    ),
)
