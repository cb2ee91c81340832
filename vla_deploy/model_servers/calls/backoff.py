"""Choose how long to wait before a request is tried again."""

from collections.abc import Callable
from dataclasses import dataclass

from vla_deploy.model_servers.errors import ModelServerError, ServerFailed, ServerUnreachable


@dataclass(frozen=True, slots=True, kw_only=True)
class Backoff:
    """Wait anything from nothing to a bound that doubles: full jitter keeps robots apart.

    `draw` gives numbers from 0 to 1.
    """

    first_s: float
    longest_s: float
    draw: Callable[[], float]

    def wait_s(self, failures: int, error: ModelServerError) -> float:
        """Return the wait after the n-th failure; never less than the server asks for."""
        bound_s = min(self.longest_s, self.first_s * 2.0 ** (failures - 1))
        asked_s = error.wait_s if isinstance(error, ServerFailed) else None
        return max(self.draw() * bound_s, asked_s or 0.0)


def may_pass(error: ModelServerError) -> bool:
    """Return whether the same request may succeed a little later, and was not carried out."""
    if isinstance(error, ServerUnreachable):
        return not error.was_sent
    return isinstance(error, ServerFailed)
