"""Tell the numeric libraries of a child how many threads they may start; they read it once."""

from collections.abc import Mapping
from typing import Final

from platforms import Profile

_VARIABLES: Final = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


def thread_limits(profile: Profile, process: str) -> Mapping[str, str]:
    """Return the environment for a process; one that no profile speaks of gets none."""
    settings = profile.processes.get(process)
    return {} if settings is None else dict.fromkeys(_VARIABLES, str(settings.threads))
