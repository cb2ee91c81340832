"""Run a robot whose lateness and budgets are judged, so by the wall clock, and measure it."""

import contextlib
import subprocess
import sys
import uuid
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Final

from sim_twin.campaigns.talk import CommandTalk
from sim_twin.campaigns.ticks import TickWatch
from sim_twin.harness.processes import ProcessStack
from sim_twin.harness.robot import RobotFailed
from vla_deploy.ipc import Topic, topics

_SWITCH_S: Final = 90.0
_FRESH_S: Final = 3.0


class WorkingRobot(ProcessStack):
    """Own one run of `sim_twin.campaigns.hosted` in `base`."""

    program = (sys.executable, "-m", "sim_twin.campaigns.hosted")
    act = ()
    errors = subprocess.STDOUT
    poll_s = 0.05

    def __init__(
        self, base: Path, *options: str, log: Path, environment: Mapping[str, str] | None = None
    ) -> None:
        """Start it; `options` are further words for `hosted`.

        Raises:
            RobotFailed: it does not come up and arm.
        """
        super().__init__(base, *options, log=log, environment=environment)
        try:
            self.wait_until_armed()
        except BaseException:
            self.close()
            raise

    # --- look ---------------------------------------------------------------------------------

    def document(
        self, topic: Topic[Any] | str, age_limit_s: float | None = _FRESH_S
    ) -> dict[str, Any]:
        """Return the newest document of a cell, empty when there is none that young."""
        return super().document(topic, age_limit_s)

    def state_and_why(self) -> tuple[str, str]:
        """Return control's state, "silent" where it publishes none, and what it says of it."""
        status = self.control_status()
        return str(status.get("state", "silent")), str(status.get("detail", ""))

    def ticks(self) -> TickWatch:
        """Return what control has counted since it started."""
        return TickWatch.of(self.document(topics.CONTROL_STATUS))

    def setpoint(self) -> list[float]:
        """Return what control sent to the joints last."""
        sample = self.session.fresh(topics.JOINT_STATE)
        return [] if sample is None else [float(one) for one in sample.data["setpoint"]]

    def memory_mib(self) -> dict[str, float]:
        """Return the memory of its own that each process holds; what is shared fills up once."""
        return {name: _anonymous_mib(pid) for name, pid in self.pids().items()}

    # --- act ----------------------------------------------------------------------------------

    def use_profile(self, path: Path, meanwhile: Callable[[], object]) -> dict[str, Any]:
        """Ask for a profile, as `vla-deploy profile use` does, and return how that ended."""
        request_id = uuid.uuid4().hex
        self.session.writer(topics.PROFILE_REQUEST).publish(
            {"request_id": request_id, "profile": str(path)}
        )

        def last() -> dict[str, Any]:
            meanwhile()
            told: dict[str, Any] = self.document(topics.PROFILE_STATUS).get("last", {})
            return told if told.get("request_id") == request_id else {}

        if not self.wait_until(last, _SWITCH_S):
            return {"outcome": "no answer", "reason": f"none within {_SWITCH_S:g} s"}
        return last()

    def talk(self) -> CommandTalk:
        """Return a way to give commands."""
        return CommandTalk(self.session)

    def wait_until(self, condition: Callable[[], object], timeout_s: float = 60.0) -> bool:
        """Return whether something came true in time.

        Raises:
            RobotFailed: the run ended meanwhile.
        """

        def is_so() -> object:
            found = condition()
            if not found and self.process.poll() is not None:
                raise RobotFailed(f"the run ended: {self.last_words()}")
            return found

        return super().wait_until(is_so, timeout_s)

    def close(self) -> None:
        """End the run, in order unless it hangs: the verdict is about its work."""
        with contextlib.suppress(RobotFailed):
            super().close()


def _anonymous_mib(pid: int) -> float:
    """Return a process' private memory.

    Raises:
        RobotFailed: the process is gone.
    """
    try:
        lines = Path(f"/proc/{pid}/status").read_text(encoding="utf-8").splitlines()
    except (FileNotFoundError, ProcessLookupError) as error:
        raise RobotFailed(f"process {pid} ended while it was measured") from error
    fields = dict(line.split(":", 1) for line in lines)
    return int(fields["RssAnon"].split()[0]) / 1024
