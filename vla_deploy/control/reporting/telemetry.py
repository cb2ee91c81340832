"""Tell the other processes what control does; nothing here waits or allocates much."""

from collections.abc import Iterable

from drivers.servo.state import BusState
from vla_deploy.control.motion.axes import Floats
from vla_deploy.control.motion.motions import MotionResult
from vla_deploy.control.output.base_drive import BaseDrive
from vla_deploy.control.reporting.tick_periods import TickPeriods
from vla_deploy.ipc import SharedSpace, topics
from vla_deploy.ipc.payloads.motion import ControlStatus


class Telemetry:
    """Write control's topics."""

    def __init__(self, space: SharedSpace, joint_count: int) -> None:
        self._joints = space.cell_writer(topics.JOINT_STATE)
        self._base = space.cell_writer(topics.BASE_STATE)
        self._status = space.cell_writer(topics.CONTROL_STATUS)
        self._results = space.ring_writer(topics.MOTION_RESULT)
        record = self._joints.record
        record["joint_count"] = joint_count
        names = (
            *("position", "velocity", "setpoint", "effort_ratio"),
            *("age_s", "error", "torque_enabled"),
        )
        self._columns = {name: record[name][:joint_count] for name in names}

    def tell_joints(self, state: BusState, setpoint: Floats) -> None:
        """Publish joint_state."""
        columns = self._columns
        columns["position"][:] = state.position_rad
        columns["velocity"][:] = state.velocity_rad_s
        columns["setpoint"][:] = setpoint
        columns["effort_ratio"][:] = state.effort_ratio
        columns["age_s"][:] = state.age_s
        columns["error"][:] = state.error
        columns["torque_enabled"][:] = state.torque_on
        self._joints.commit()

    def tell_base(self, wheels: BaseDrive) -> None:
        """Publish base_state."""
        odometry, record = wheels.odometry, self._base.record
        record["x_m"] = odometry.x_m
        record["y_m"] = odometry.y_m
        record["yaw_rad"] = odometry.yaw_rad
        record["v_m_s"], record["w_rad_s"], record["left_m_s"] = wheels.velocity
        record["enabled"] = wheels.enabled
        self._base.commit()

    def tell_status(self, document: ControlStatus) -> None:
        """Publish control_status."""
        self._status.put_document(document)

    def tell_results(self, results: Iterable[MotionResult]) -> None:
        """Publish how motions ended."""
        for result in results:
            self._results.publish(
                {
                    "motion_id": result.motion_id,
                    "status": result.ending.value,
                    "reason": result.reason,
                }
            )

    def close(self) -> None:
        """Unmap the topics."""
        for writer in (self._joints, self._base, self._status, self._results):
            writer.close()


class TickClock:
    """Measure the ticks: how long since the last one, how many came late."""

    def __init__(self, period_s: float) -> None:
        self.tick = 0
        self.periods = TickPeriods()
        self.period_s = period_s
        self._nominal_s = period_s
        self._next_nominal_s = period_s
        self._last_ns: int | None = None

    @property
    def late_ticks(self) -> int:
        """Return how many ticks began late."""
        return self.periods.late

    @property
    def nominal_s(self) -> float:
        """Return the period that the next tick is to keep."""
        return self._next_nominal_s

    def retune(self, period_s: float) -> None:
        """Expect another period from the next tick on: the time up to it has the old one."""
        self._next_nominal_s = period_s

    def begin(self, now_ns: int) -> float:
        """Count a tick and return the time it stands for: at most two periods."""
        self.tick += 1
        last_ns, self._last_ns = self._last_ns, now_ns
        nominal_s, self._nominal_s = self._nominal_s, self._next_nominal_s
        if last_ns is None:
            return nominal_s
        gap_s = (now_ns - last_ns) / 1e9
        self.periods.count(gap_s / nominal_s)
        self.period_s += 0.02 * (gap_s - self.period_s)
        return min(max(gap_s, 0.0), 2.0 * nominal_s)
