"""Define what executor and ROS gateway say to each other about goals of servers beyond the robot.

The executor sends `GoalRequest` documents on `ros_request`, the gateway `GoalAnswer` documents on
`ros_answer`. Everything is bounded, and checked by whoever receives it.
"""

import math
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass
from enum import StrEnum
from typing import Any, Final

MOST_POINTS: Final = 200
"""Of a trajectory: what fits into a slot of the ring, and what the robot's own servers take."""
MOST_JOINTS: Final = 32
MOST_TEXT: Final = 500
PERMIT_S: Final = 0.5
"""How long the executor's leave to drive holds; it repeats it while it watches."""
SERVER_WAIT_S: Final = 5.0


class GoalKind(StrEnum):
    """Name the actions that are asked for."""

    NAVIGATE = "navigate_to_pose"
    FOLLOW = "follow_joint_trajectory"


class GoalAct(StrEnum):
    """Name what the executor asks of the gateway."""

    SEND = "send"
    CANCEL = "cancel"
    PERMIT = "permit"
    HOLD = "hold"


class GoalState(StrEnum):
    """Name how a goal stands; the last five are final."""

    ACCEPTED = "accepted"
    FEEDBACK = "feedback"
    CANCELLING = "cancelling"
    CANCEL_REJECTED = "cancel_rejected"
    SUCCEEDED = "succeeded"
    REJECTED = "rejected"
    ABORTED = "aborted"
    CANCELLED = "cancelled"
    LOST = "lost"

    @property
    def is_final(self) -> bool:
        """Return whether nothing more comes."""
        return self in _FINAL


_FINAL: Final = frozenset(
    {
        GoalState.SUCCEEDED,
        GoalState.REJECTED,
        GoalState.ABORTED,
        GoalState.CANCELLED,
        GoalState.LOST,
    }
)


@dataclass(frozen=True, slots=True, kw_only=True)
class GoalRequest:
    """Ask for a goal of one server.

    `holder` is the claim under which the executor holds `parts`: while the goal is under way, the
    server may move these parts through the gateway. `pose` is x, y in m and yaw in rad of the map.
    `times_s` rise from above 0, `positions` are (times, joints) in rad, or m for a finger.
    `most_m_s` bounds the speed of the base, 0 leaves it to control.
    """

    act: GoalAct = GoalAct.SEND
    request_id: str
    kind: GoalKind
    server: str
    holder: str
    parts: tuple[str, ...]
    timeout_s: float
    server_wait_s: float = SERVER_WAIT_S
    pose: tuple[float, float, float] | None = None
    most_m_s: float = 0.0
    joints: tuple[str, ...] = ()
    times_s: tuple[float, ...] = ()
    positions: tuple[tuple[float, ...], ...] = ()

    def document(self) -> dict[str, Any]:
        """Return it as JSON."""
        return asdict(self)


@dataclass(frozen=True, slots=True, kw_only=True)
class GoalAnswer:
    """Say how a goal stands; `left_m` is the rest of a way, where the server tells it."""

    request_id: str
    state: GoalState
    text: str = ""
    left_m: float | None = None

    def document(self) -> dict[str, Any]:
        """Return it as JSON."""
        return {
            "request_id": self.request_id,
            "state": self.state.value,
            "text": self.text[:MOST_TEXT],
            "left_m": self.left_m,
        }


class RosGoalUnreadable(ValueError):
    """Say what is wrong with a request or an answer."""


def read_request(document: Mapping[str, Any]) -> GoalRequest:
    """Return the request that a document holds.

    Raises:
        GoalUnreadable: a part is missing, of the wrong kind, or out of bounds.
    """
    try:
        pose, rows = document.get("pose"), document.get("positions", ())
        request = GoalRequest(
            **{
                **document,
                "act": GoalAct(document["act"]),
                "kind": GoalKind(document["kind"]),
                "parts": tuple(map(str, document["parts"])),
                "pose": None if pose is None else tuple(map(float, pose)),
                "joints": tuple(map(str, document.get("joints", ()))),
                "times_s": tuple(map(float, document.get("times_s", ()))),
                "positions": tuple(tuple(map(float, row)) for row in rows),
            }
        )
    except (KeyError, TypeError, ValueError) as error:
        raise RosGoalUnreadable(f"ros_request: not a request for a goal: {error}") from error
    fault = next(_faults(request), "")
    if fault:
        raise RosGoalUnreadable(f"ros_request {request.request_id}: {fault}")
    return request


def read_answer(document: Mapping[str, Any]) -> GoalAnswer:
    """Return the answer that a document holds.

    Raises:
        GoalUnreadable: a part is missing or of the wrong kind.
    """
    try:
        return GoalAnswer(**{**document, "state": GoalState(document["state"])})
    except (KeyError, TypeError, ValueError) as error:
        raise RosGoalUnreadable(f"ros_answer: not an answer about a goal: {error}") from error


def _faults(request: GoalRequest) -> Iterator[str]:
    numbers = (
        *(request.pose or ()),
        *request.times_s,
        *(value for row in request.positions for value in row),
        *(request.timeout_s, request.server_wait_s, request.most_m_s),
    )
    if not all(map(math.isfinite, numbers)):
        yield "expected finite numbers"
    if request.timeout_s <= 0.0 or request.server_wait_s < 0.0:
        yield f"timeout_s: expected above 0, got {request.timeout_s}"
    if request.kind is GoalKind.NAVIGATE and (request.pose is None or len(request.pose) != 3):
        yield f"pose: expected x, y, yaw, got {request.pose}"
    if request.kind is GoalKind.FOLLOW:
        yield from _trajectory_faults(request)


def _trajectory_faults(request: GoalRequest) -> Iterator[str]:
    width, count = len(request.joints), len(request.times_s)
    if not 0 < width <= MOST_JOINTS:
        yield f"joints: expected 1 to {MOST_JOINTS}, got {width}"
    if not 0 < count <= MOST_POINTS:
        yield f"times_s: expected 1 to {MOST_POINTS}, got {count}"
    if len(request.positions) != count or any(len(row) != width for row in request.positions):
        yield f"positions: expected {count} rows of {width}"
    rises = all(a < b for a, b in zip((0.0, *request.times_s), request.times_s, strict=False))
    if not rises:
        yield "times_s: expected times that rise from above 0"
