"""Read what the computer tells of itself: load, memory, power, heat, throttling, disk.

A number that cannot be had is a reading without a value and with a reason, never 0.
"""

from platforms.probes.cgroup import Cgroup, read_cgroup
from platforms.probes.power_mode import PowerModes, read_power_modes
from platforms.probes.probe_set import ProbeSet, open_probes
from platforms.probes.reading import Reading

__all__ = [
    "Cgroup",
    "PowerModes",
    "ProbeSet",
    "Reading",
    "open_probes",
    "read_cgroup",
    "read_power_modes",
]
