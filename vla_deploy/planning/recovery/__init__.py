"""Plan anew after a failure: what is left of the plan, mended by one strategy after another."""

from vla_deploy.planning.recovery.setback import (
    Carried,
    FailureCause,
    Setback,
    numbered,
    read_setback,
)
from vla_deploy.planning.recovery.strategies import RECOVERY, recover

__all__ = [
    "RECOVERY",
    "Carried",
    "FailureCause",
    "Setback",
    "numbered",
    "read_setback",
    "recover",
]
