"""Run the robot's real processes on a twin, at a priority that the benchmark chooses."""

from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Final

from drivers.clock import NS_PER_S
from sim_twin.process_stack import ProcessStack
from vla_deploy.cli.session import Session

_ACT_S: Final = 15.0
_LOOKS_PER_TRY: Final = 25


class NotReached(Exception):
    """Say that control does not follow: there is nothing to measure."""


@contextmanager
def live_robot(folder: Path, realtime_priority: int) -> Iterator[Session]:
    """Give a session with a desktop's robot whose control has this priority; 0 is none.

    Raises:
        StackFailed: the processes do not come up.
    """
    profile = folder / "bench.toml"
    text = f'inherits = "desktop"\nrealtime_priority = {realtime_priority}\n'
    profile.write_text(text, encoding="utf-8")
    stack = ProcessStack(folder / "run", "--profile", str(profile))
    try:
        stack.wait_until_ready()
        with closing(Session(stack.run_dir)) as session:
            yield session
    finally:
        stack.close()


def reach(session: Session, act: str, wanted: str) -> None:
    """Do an operator's act, again where a busy machine gets in the way, until control is there.

    Raises:
        NotReached: control stays elsewhere.
    """
    deadline_ns = session.clock.now_ns() + round(_ACT_S * NS_PER_S)
    status = None
    while session.clock.now_ns() < deadline_ns:
        session.operate(act)
        for _ in range(_LOOKS_PER_TRY):
            status = session.document("control_status", age_limit_s=0.5)
            if status is not None and status["state"] == wanted:
                return
            session.pause()
    found = "silent" if status is None else f"{status['state']}: {status['detail']}"
    raise NotReached(f"{act}: control is not {wanted} after {_ACT_S:g} s, but {found}")
