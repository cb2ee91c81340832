"""Plan anew after a failure: what is left of the plan, mended by one strategy after another."""

from vla_deploy.planning.recovery.recovering import MOST_RECOVERIES, RECOVERY, numbered, recover
from vla_deploy.planning.recovery.setback import Carried, Cause, Setback, read_setback

__all__ = [
    "MOST_RECOVERIES",
    "RECOVERY",
    "Carried",
    "Cause",
    "Setback",
    "numbered",
    "read_setback",
    "recover",
]
