"""Derive from the process table how patient a service manager has to be with the whole run."""

import math
from collections.abc import Sequence
from typing import Final

from drivers.clock import NS_PER_S
from vla_deploy.supervisor.processes.lifecycle import ABORT_GRACE_NS, delay_s, give_up_s
from vla_deploy.supervisor.table import TABLE, GivingUp, ProcessSpec

RESTART_S: Final = 2
START_BURST: Final = 5
_FEEDER: Final = "control"  # the dog goes hungry when its status grows old
_CONTROL_START_S: Final = 8.0
_S_PER_MINUTE: Final = 60


def watchdog_s(table: Sequence[ProcessSpec] = TABLE) -> int:
    """Return how long the watchdog waits: until a control that hangs is noticed and up again.

    What the dog was last fed before its status grew old, and how old that may grow, cancel out.
    """
    (spec,) = (spec for spec in table if spec.name == _FEEDER)
    limits_s = [topic.silence_limit_s for topic in spec.watched if topic.silence_limit_s]
    ended_s = min(limits_s) + ABORT_GRACE_NS / NS_PER_S
    return math.ceil(ended_s + delay_s(spec.restart, 1) + _CONTROL_START_S)


def start_limit_s(table: Sequence[ProcessSpec] = TABLE) -> int:
    """Return within what time `START_BURST` failed starts end the service, in whole minutes.

    Even those fall within it that fail as slowly as a start can, or it would be tried for ever.
    """
    once_s = longest_start_s(table) + sum(spec.stop_timeout_s for spec in table) + RESTART_S
    return math.ceil(START_BURST * once_s / _S_PER_MINUTE) * _S_PER_MINUTE


def longest_start_s(table: Sequence[ProcessSpec] = TABLE) -> float:
    """Return how long a start takes at most that fails because one process never gets ready."""
    before_s = stage_s = longest_s = 0.0
    for spec in table:
        if not spec.with_previous:
            before_s, stage_s = before_s + stage_s, 0.0
        stage_s = max(stage_s, spec.ready_timeout_s)
        if spec.giving_up is not GivingUp.CARRY_ON:
            longest_s = max(longest_s, before_s + give_up_s(spec))
    return longest_s
