"""Play cases on a Ray cluster: each is a task on one core, and Ray decides where."""

import os
from collections.abc import Callable, Iterable
from typing import Any, Final, TypeVar

from sim_twin.campaigns.report import CaseT, told
from sim_twin.campaigns.selection import OptionRefused

LOCAL: Final = "local"
"""In the place of an address: start Ray on this computer, and end it afterwards."""
T = TypeVar("T")


class RayUnusable(OptionRefused):
    """Say why Ray cannot be used."""


def played_by_ray(
    play: Callable[[T], CaseT],
    cases: Iterable[T],
    address: str,
    workers: int,
    tell: Callable[[str], None],
) -> tuple[CaseT, ...]:
    """Return every case played, in order; `workers` at a time where Ray is started here.

    A cluster's computers need this package, in the same version.

    Raises:
        RayUnusable: it is not installed, or no cluster answers at the address.
    """
    ray = _begun(address, workers)
    try:
        # A process of its own for each case: what one leaves behind is no part of the next.
        task = ray.remote(num_cpus=1, max_calls=1, max_retries=0)(play)
        running = [task.remote(case) for case in cases]
        return tuple(told(ray.get(one), tell) for one in running)
    finally:
        ray.shutdown()


def _begun(address: str, workers: int) -> Any:
    try:
        import ray
    except ImportError as error:
        raise RayUnusable(
            "--ray: Ray is not installed; install it with: pip install 'vla-deploy[ray]'"
        ) from error
    os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")  # it reports to its makers otherwise
    here = {"num_cpus": workers, "include_dashboard": False}
    where = here if address == LOCAL else {"address": address}
    try:
        ray.init(**where, configure_logging=False, log_to_driver=False)
    except (ConnectionError, ValueError, RuntimeError) as error:
        raise RayUnusable(f"--ray {address}: {error}; start one with: ray start --head") from error
    return ray
