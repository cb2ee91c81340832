"""Read what the budgets ask of the processes."""

from collections.abc import Mapping

from vla_deploy.ipc import SharedSpace


class Directives:
    """Watch the `resource_directives` cell; before its first word nothing is asked."""

    def __init__(self, space: SharedSpace) -> None:
        self._cell = space.cell_reader("resource_directives")
        self._sequence = 0
        self.suspended: Mapping[str, str] = {}
        """The processes that shall not run, each with the reason."""
        self.rate_ratios: Mapping[str, float] = {}
        """The share of its rate at which a process shall work; one that is not named, at all."""

    def refresh(self) -> None:
        """Take in the newest word."""
        sample = self._cell.latest()
        if sample is None or sample.sequence == self._sequence:
            return
        self._sequence = sample.sequence
        document = sample.document()
        self.suspended = dict.fromkeys(document["suspended"], "suspended by the budgets")
        self.rate_ratios = document["rate_ratio"]
