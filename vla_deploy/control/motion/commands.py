"""Read motion commands: check everything a sender may have got wrong, and say what it was."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from vla_deploy.control.motion.axes import Axes, Floats


class CommandRefused(ValueError):
    """Say why a motion command is not carried out."""


@dataclass(frozen=True, slots=True, kw_only=True)
class JointGoal:
    """Ask joints to go to values; `together`: none arrives before the others."""

    motion_id: int
    axes: Axes
    target: Floats
    speed_ratio: float
    effort_ratio: Mapping[int, float] = field(default_factory=dict)
    together: bool = True


@dataclass(frozen=True, slots=True, kw_only=True)
class Waypoints:
    """Ask joints to pass timed points.

    With a `contact_ratio` they feel their way: a torque that grows by this share of a joint's
    contact limit ends the motion as touched.
    """

    motion_id: int
    axes: Axes
    joints: tuple[str, ...]
    times_s: Floats
    positions: Floats
    contact_ratio: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Cancel:
    """Ask to end a motion."""

    motion_id: int


@dataclass(frozen=True, slots=True, kw_only=True)
class RestAsked:
    """Say that all that the sender moves comes to rest now, because somebody asked for it."""

    source: str


Command = JointGoal | Waypoints | Cancel | RestAsked


def motion_id_of(payload: Mapping[str, Any]) -> int | None:
    """Return the command's id, or None when there is none to answer to."""
    motion_id = payload.get("motion_id")
    return motion_id if isinstance(motion_id, int) and not isinstance(motion_id, bool) else None


def parse_command(payload: Mapping[str, Any], joint_index: Mapping[str, int]) -> Command:
    """Return the command of a `motion_command` document.

    Raises:
        CommandRefused: a key is missing or holds what is not allowed.
    """
    motion_id = motion_id_of(payload)
    if motion_id is None:
        raise CommandRefused(f"motion_id: expected an integer, got {payload.get('motion_id')!r}")
    match payload.get("kind"):
        case "goal":
            return _goal(motion_id, payload, joint_index)
        case "trajectory":
            return _waypoints(motion_id, payload, joint_index)
        case "cancel":
            return Cancel(motion_id=motion_id)
        case "rest":
            return RestAsked(source=str(payload.get("source", "")))
        case other:
            raise CommandRefused(f"kind: expected goal, trajectory, cancel or rest, got {other!r}")


def _goal(motion_id: int, payload: Mapping[str, Any], joint_index: Mapping[str, int]) -> JointGoal:
    targets = _table(payload, "targets")
    if not targets:
        raise CommandRefused("targets: expected at least one joint, got none")
    efforts = _table(payload, "effort_ratio") if "effort_ratio" in payload else {}
    axes = _axes(targets, joint_index)
    effort_axes = _axes(efforts, joint_index)
    return JointGoal(
        motion_id=motion_id,
        axes=axes,
        target=np.array([_number(targets, joint) for joint in targets]),
        speed_ratio=_ratio(payload, "speed_ratio"),
        effort_ratio={
            int(axis): _ratio(efforts, joint)
            for axis, joint in zip(effort_axes, efforts, strict=True)
        },
        together=_flag(payload, "together", absent=True),
    )


def _waypoints(
    motion_id: int, payload: Mapping[str, Any], joint_index: Mapping[str, int]
) -> Waypoints:
    joints = payload.get("joints")
    if not isinstance(joints, list) or not joints or len(set(map(str, joints))) != len(joints):
        raise CommandRefused(f"joints: expected a list of different joints, got {joints!r}")
    return Waypoints(
        motion_id=motion_id,
        axes=_axes(dict.fromkeys(map(str, joints)), joint_index),
        joints=tuple(map(str, joints)),
        times_s=_array(payload, "times_s", 1),
        positions=_array(payload, "positions", 2),
        contact_ratio=_ratio(payload, "contact_ratio") if "contact_ratio" in payload else None,
    )


def _axes(joints: Mapping[str, Any], joint_index: Mapping[str, int]) -> Axes:
    unknown = [joint for joint in joints if joint not in joint_index]
    if unknown:
        raise CommandRefused(f"no joint {', '.join(unknown)}; there are {', '.join(joint_index)}")
    return np.array([joint_index[joint] for joint in joints], dtype=np.intp)


def _table(payload: Mapping[str, Any], key: str) -> Mapping[str, Any]:
    value = payload.get(key)
    if not isinstance(value, dict):
        raise CommandRefused(f"{key}: expected a value per joint, got {value!r}")
    return value


def _number(table: Mapping[str, Any], key: str) -> float:
    value = table.get(key)
    if isinstance(value, bool) or not isinstance(value, int | float) or not np.isfinite(value):
        raise CommandRefused(f"{key}: expected a finite number, got {value!r}")
    return float(value)


def _ratio(table: Mapping[str, Any], key: str) -> float:
    value = _number(table, key)
    if not 0.0 < value <= 1.0:
        raise CommandRefused(f"{key}: expected above 0 and at most 1, got {value:g}")
    return value


def _flag(payload: Mapping[str, Any], key: str, *, absent: bool) -> bool:
    value = payload.get(key, absent)
    if not isinstance(value, bool):
        raise CommandRefused(f"{key}: expected true or false, got {value!r}")
    return value


def _array(payload: Mapping[str, Any], key: str, dimensions: int) -> Floats:
    try:
        array = np.asarray(payload.get(key), dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise CommandRefused(f"{key}: expected numbers: {error}") from error
    if array.ndim != dimensions:
        raise CommandRefused(f"{key}: expected {dimensions} dimensions, got {array.ndim}")
    return array
