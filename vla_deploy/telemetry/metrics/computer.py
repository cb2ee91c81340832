"""Declare what is measured of the computer: each metric is a reading of the probes."""

from typing import Final

from vla_deploy.telemetry.metrics.metric import Metric
from vla_deploy.telemetry.metrics.paths import PathStep, among, at, each, keys, path

TOPIC: Final = "board"
BATTERY_TOPIC: Final = "battery"
_PRESSURES: Final = {name: f"psi_{name}_ratio" for name in ("cpu", "memory", "io")}


def _gauge(name: str, text: str, *, reading: str = "", kept: bool = False) -> Metric:
    """Declare one reading; its own name is given where the metric has another one."""
    return Metric(f"vla_{name}", text, at(f"readings.{reading or name}"), topic=TOPIC, kept=kept)


def _family(name: str, text: str, step: PathStep) -> Metric:
    """Declare readings that differ in a label."""
    return Metric(f"vla_{name}", text, path(keys("readings"), step), topic=TOPIC)


BATTERY: Final[tuple[Metric, ...]] = (
    Metric(
        "vla_battery_charge_ratio",
        "How full the battery is.",
        at("charge_ratio"),
        topic=BATTERY_TOPIC,
        kept=True,
    ),
    Metric(
        "vla_battery_voltage_volts",
        "Voltage of the battery.",
        at("voltage_v"),
        topic=BATTERY_TOPIC,
        kept=True,
    ),
    Metric(
        "vla_battery_current_amperes",
        "Current into the battery; negative while it is drained.",
        at("current_a"),
        topic=BATTERY_TOPIC,
    ),
    Metric(
        "vla_battery_charging",
        "1 while the battery charges.",
        at("is_charging"),
        topic=BATTERY_TOPIC,
    ),
    *(
        Metric(
            f"vla_battery_{level}",
            f"1 while the battery is {level}, by the robot file.",
            at(level),
            topic=BATTERY_TOPIC,
        )
        for level in ("low", "critical")
    ),
)

METRICS: Final[tuple[Metric, ...]] = (
    _gauge("cpu_used_ratio", "Share of all cores that is busy.", reading="cpu_ratio", kept=True),
    _gauge("cpu_frequency_hertz", "Clock of the fastest cores.", reading="cpu_frequency_hz"),
    _gauge("memory_total_bytes", "Memory of the computer."),
    _gauge("memory_available_bytes", "Memory that programs can still get.", kept=True),
    _gauge("swap_used_bytes", "Swap in use."),
    _gauge(
        "gpu_memory_used_bytes",
        "Memory that the GPU holds; on a Jetson it is part of the same memory.",
        kept=True,
    ),
    _gauge("gpu_load_ratio", "Share of time that the GPU is busy.", kept=True),
    _gauge("gpu_frequency_hertz", "Clock of the GPU.", reading="gpu_frequency_hz"),
    _gauge("emc_load_ratio", "Use of the memory bus."),
    _gauge("power_watts", "Power that the board takes.", reading="power_w", kept=True),
    _gauge(
        "temperature_celsius",
        "Temperature of the hottest zone that can be read.",
        reading="temperature_c",
        kept=True,
    ),
    _gauge("fan_rpm", "Revolutions of the fan per minute."),
    _gauge("fan_drive_ratio", "How hard the fan is driven."),
    _gauge("power_mode", "Id of the power mode, as nvpmodel names it.", reading="power_mode_id"),
    _gauge(
        "disk_free_bytes", "Room on the tightest of the disks that the robot writes to.", kept=True
    ),
    _gauge(
        "disk_free_ratio",
        "Share that is free of the tightest of the disks that the robot writes to.",
    ),
    _family("power_rail_watts", "Power of one rail of the board.", each("rail", "power_w.")),
    _family(
        "zone_temperature_celsius",
        "Temperature of one thermal zone.",
        each("zone", "temperature_c."),
    ),
    _family(
        "throttle_events_total",
        "Under-voltage (oc1), average (oc2) and instantaneous (oc3) over-current since boot.",
        each("kind", "throttle_count."),
    ),
    _family(
        "pressure_ratio",
        "Share of the last 10 s in which something waited for CPU, memory or disk.",
        among("resource", _PRESSURES),
    ),
)
