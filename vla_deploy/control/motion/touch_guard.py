"""End a motion that feels its way as soon as its joints have met something.

What weight, payload and friction leave unexplained was there before the motion began, so only what
comes on top of that counts: much less than a contact limit is enough to tell a touch.
"""

from collections.abc import Sequence

import numpy as np

from vla_deploy.control.motion.axes import Floats


class TouchGuard:
    """Compare the torque of one motion's joints with what they felt when it began."""

    def __init__(self, joints: Sequence[str], most_nm: Floats) -> None:
        """Bound what may come on top, in N m per joint; an infinite bound is never passed."""
        self._joints = joints
        self._most_nm = most_nm
        self._before_nm: Floats | None = None

    def touch(self, external_torque_nm: Floats) -> str:
        """Say which joint has met something, and how hard; "" while none has."""
        if self._before_nm is None:
            self._before_nm = external_torque_nm.copy()
        felt_nm = np.abs(external_torque_nm - self._before_nm)
        most = int((felt_nm / self._most_nm).argmax())
        if felt_nm[most] <= self._most_nm[most]:
            return ""
        return (
            f"{self._joints[most]} has met something: {felt_nm[most]:.2f} N m more than before, "
            f"{self._most_nm[most]:.2f} allowed"
        )
