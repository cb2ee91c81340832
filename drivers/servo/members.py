"""Check and choose the servos of one bus, and check goals for them."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from drivers.servo.joint_servo import JointServo


class BusMembers:
    """Look up the servos of a bus by their ids."""

    def __init__(self, servos: Sequence[JointServo]) -> None:
        """Take the servos in the order of the bus.

        Raises:
            ValueError: no servo, or an id or joint twice.
        """
        if not servos:
            raise ValueError("a servo bus needs at least one servo, got none")
        for what in ("id", "joint"):
            values = [str(getattr(servo, what)) for servo in servos]
            if twice := sorted({value for value in values if values.count(value) > 1}):
                raise ValueError(f"each servo needs its own {what}, got twice: {', '.join(twice)}")
        self._by_id = {servo.id: index for index, servo in enumerate(servos)}

    def chosen(self, ids: Sequence[int] | None) -> list[int]:
        """Return the places of servos on the bus, of all without `ids`.

        Raises:
            ValueError: no such servo.
        """
        if ids is None:
            return list(self._by_id.values())
        unknown = sorted(set(ids) - set(self._by_id))
        if unknown:
            raise ValueError(f"no servo {unknown} on this bus; it has {sorted(self._by_id)}")
        return [self._by_id[servo_id] for servo_id in ids]


def require_goals(joints: Sequence[str], goals: NDArray[np.float64]) -> None:
    """Check that there is one goal for each joint, and that all are numbers.

    Raises:
        ValueError: they are not; names the joints.
    """
    if goals.shape != (len(joints),):
        raise ValueError(f"expected {len(joints)} goals, got shape {goals.shape}")
    bad = [joint for joint, good in zip(joints, np.isfinite(goals), strict=True) if not good]
    if bad:
        raise ValueError(f"goals must be finite, got others for {', '.join(bad)}")
