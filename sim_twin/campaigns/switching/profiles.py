"""Declare the profiles of the switches campaign: two that can be kept, and bad ones."""

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

# Rates that two cores keep beside the twin; the drives' period may change in motion, and so may
# control's priority, where others run, and how a model is loaded: its only tier with other threads.
GOOD: Final[Mapping[str, str]] = {
    "swift": """inherits = "desktop"
control_rate_hz = 125
executor_rate_hz = 25
[budgets]
perception = { memory_mb = 600, cpu_ratio = 1.2 }
""",
    "calm": """inherits = "desktop"
control_rate_hz = 100
executor_rate_hz = 20
perception_rate_hz = 4
camera_rate_hz = 4
realtime_priority = 35
[processes]
recorder = { affinity = [0], nice = 12 }
executor = { affinity = [1] }
[models.detector]
threads = 2
[budgets]
perception = { memory_mb = 550, cpu_ratio = 1.0 }
planner = { memory_mb = 200, cpu_ratio = 0.3 }
""",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Bad:
    """Declare a profile that must not stay: its text, how that may end, a word of the reason."""

    name: str
    text: str
    outcomes: tuple[str, ...]
    reason: str

    @property
    def case(self) -> str:
        """Return the name of its case."""
        return f"bad/{self.name}"


_LIKE_SWIFT: Final = 'inherits = "desktop"\ncontrol_rate_hz = 125\nexecutor_rate_hz = 25\n'
BAD: Final = (
    Bad(
        name="not_toml",
        text=_LIKE_SWIFT + "perception_rate_hz = \n",
        outcomes=("refused",),
        reason="not_toml.toml",
    ),
    Bad(
        name="out_of_range",
        text='inherits = "desktop"\ncontrol_rate_hz = 9000\n',
        outcomes=("refused",),
        reason="control_rate_hz",
    ),
    Bad(
        name="unknown_key",
        text=_LIKE_SWIFT + "speed = 3\n",
        outcomes=("refused",),
        reason="speed",
    ),
    Bad(
        name="process_refuses",
        text=_LIKE_SWIFT + "bus_watchdog_s = 0.5\n",
        outcomes=("refused",),
        reason="control",
    ),
    Bad(
        name="memory_not_kept",
        text=_LIKE_SWIFT + "[budgets]\nplanner = { memory_mb = 10, cpu_ratio = 0.2 }\n",
        outcomes=("rolled back",),
        reason="planner",
    ),
    Bad(
        name="computer_too_small",
        text=_LIKE_SWIFT
        + "[board]\nmemory_mb = 200000\n[budgets.total]\nmemory_mb = 190000\ncpu_ratio = 3.5\n",
        outcomes=("refused",),
        reason="memory",
    ),
)


def control_rate_hz(name: str) -> float:
    """Return the rate of control in a good profile."""
    return float(tomllib.loads(GOOD[name])["control_rate_hz"])
