"""Run the robot's real processes on a twin, at a priority that the benchmark chooses."""

from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Final

from sim_twin.harness.processes import ProcessStack

PROFILE_FILE: Final = "bench.toml"


@contextmanager
def live_stack(folder: Path, profile: str, *options: str) -> Iterator[ProcessStack]:
    """Give the processes of a robot by the text of a profile, which lies in `PROFILE_FILE`.

    `options` are further words for `vla-deploy run`.

    Raises:
        RobotFailed: the processes do not come up.
    """
    (folder / PROFILE_FILE).write_text(profile, encoding="utf-8")
    chosen = ("--wall", "--profile", str(folder / PROFILE_FILE), *options)
    with closing(ProcessStack(folder / "run", *chosen)) as stack:
        stack.wait_until_ready()
        yield stack


@contextmanager
def live_robot(folder: Path, realtime_priority: int) -> Iterator[ProcessStack]:
    """Give a desktop's robot whose control has this priority; 0 is none.

    Raises:
        RobotFailed: the processes do not come up.
    """
    profile = f'inherits = "desktop"\nrealtime_priority = {realtime_priority}\n'
    with live_stack(folder, profile) as stack:
        yield stack
