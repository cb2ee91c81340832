"""Plan anew after a failure: what is left of the plan, mended by one strategy after another."""

from vla_deploy.planning.recovery.recovering import RECOVERY, numbered, recover
from vla_deploy.planning.recovery.setback import Carried, Cause, Setback, read_setback

__all__ = [
    "RECOVERY",
    "Carried",
    "Cause",
    "Setback",
    "numbered",
    "read_setback",
    "recover",
]
