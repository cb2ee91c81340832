"""Tell what a child has from its very start: threads of its numeric libraries, and its nice."""

from collections.abc import Mapping
from typing import Final

from platforms import Profile

_VARIABLES: Final = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


def thread_limits(profile: Profile, process: str) -> Mapping[str, str]:
    """Return the environment for a process; one that no profile speaks of gets none."""
    settings = profile.processes.get(process)
    return {} if settings is None else dict.fromkeys(_VARIABLES, str(settings.threads))


def nice_of(profile: Profile, process: str) -> int:
    """Return how nice a process is; one that no profile speaks of is as others are."""
    settings = profile.processes.get(process)
    return 0 if settings is None else settings.nice
