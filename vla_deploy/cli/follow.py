"""Wait for what becomes of one command."""

from collections.abc import Callable, Iterator, Sequence

from drivers.clock import Clock
from vla_deploy.cli.errors import CommandFailed
from vla_deploy.client.following import ANSWER_TIMEOUT_S, Event, Following, Newest

NO_ANSWER = (
    f"no answer from planner or executor within {ANSWER_TIMEOUT_S:g} s, the command is not carried "
    "out; see: vla-deploy status, and to stop the robot at once: vla-deploy estop"
)


def follow_command(
    command_id: str,
    *,
    events: Callable[[], Sequence[Event]],
    planner: Newest,
    executor: Newest,
    clock: Clock,
    pause: Callable[[], None],
) -> Iterator[Event]:
    """Return the command's events; the last is `finished` or `rejected`, told or found out.

    `events` drains the ring of task events; `planner` and `executor` return their status while that
    is young. Where the command answers a question, the one that was asked about is followed on.

    Raises:
        CommandFailed: nobody has answered in time.
    """
    following = Following(command_id, planner, executor, clock)
    while True:
        why = following.why_lost()
        yield from following.take(events())
        found_out = following.conclude(why)
        if found_out is not None:
            yield found_out
        if following.has_ended:
            return
        if following.is_unanswered:
            raise CommandFailed(NO_ANSWER)
        pause()
