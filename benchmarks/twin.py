"""Measure what the emulated devices cost on top of the physics, and how fast lock-step runs.

Five runs of the same robot in the same world take turns, so that a busy machine hits all of them.
The fastest round of each in CPU time counts: neighbours on the machine only ever make it slower.

- raw `mj_step`;
- the twin alone, its servos without torque (16 servos, two drives, lidar, IMU; no camera);
- the twin in lock-step with the real drivers of servos, wheel drives and lidar: all servos hold
  torque and follow goals and the base turns, 250 bus cycles a second; of this run comes
  `real_time_factor`, and `mj_step_cpu_ratio`, the share of `mj_step` in the CPU time of the twin's
  own step, in the round whose steps took the least (`..._median`: of all rounds).
  `mj_step_cpu_ratio_with_answers` counts to the twin also what the devices do to answer
  the buses, in `receive` and `transmit`;
- the same with the IMU: `mj_step_cpu_ratio_with_imu`;
- lock-step with the whole control node on the buses, disarmed, at the profile's rate.
"""

import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final

import mujoco

from benchmarks.command import parser, show
from benchmarks.device_traffic import DeviceTraffic
from benchmarks.stopwatch import Stopwatch
from platforms import load_profile
from sim_twin.harness.lockstep import Lockstep
from sim_twin.physics.compose import STEP_S
from sim_twin.physics.engine import Engine
from sim_twin.physics.load import load_engine
from sim_twin.twin import Twin
from vla_deploy.control.node import ControlNode
from vla_deploy.robots import RobotDescription, load_robot

_SEED: Final = 0
_WARM_UP_STEPS: Final = 200
_NEVER_NS: Final = 1 << 62

Runner = Callable[[int], None]


def measure(robot_name: str, world: str, rounds: int, steps: int) -> dict[str, Any]:
    """Return step rates, their ratios and real-time factors, of the fastest rounds."""
    robot = load_robot(robot_name)
    engine = load_engine(robot, world, _SEED)
    twin = Twin(robot, world, _SEED)
    with (
        _busy_lockstep(robot_name, world, imu=False) as busy,
        _busy_lockstep(robot_name, world, imu=True) as busier,
        _controlled_lockstep(robot, world) as control,
    ):
        watch, watch_with_imu = Stopwatch(busy.twin), Stopwatch(busier.twin)
        runners: dict[str, Runner] = {
            "raw": lambda count: _step_raw(engine, count),
            "twin": lambda count: _step_twin(twin, count),
            "busy": lambda count: busy.run_for(count * STEP_S),
            "busier": lambda count: busier.run_for(count * STEP_S),
            "control": lambda count: control.run_for(count * STEP_S),
        }
        rates = _best_rates(runners, rounds, steps, (watch, watch_with_imu))
    return {
        "robot": robot_name,
        "world": world,
        "rounds": rounds,
        "steps_per_round": steps,
        "raw_steps_per_s": rates["raw"],
        "twin_steps_per_s": rates["twin"],
        "step_rate_ratio_vs_raw": rates["twin"] / rates["raw"],
        "twin_real_time_factor": rates["twin"] * STEP_S,
        "mj_step_cpu_ratio": watch.physics_ratio,
        "mj_step_cpu_ratio_median": watch.physics_ratio_median,
        "mj_step_cpu_ratio_with_imu": watch_with_imu.physics_ratio,
        "mj_step_cpu_ratio_with_answers": watch.physics_ratio_with_answers,
        "real_time_factor": rates["busy"] * STEP_S,
        "control_real_time_factor": rates["control"] * STEP_S,
    }


def main(argv: Sequence[str] | None = None) -> int:
    """Print the comparison."""
    arguments = parser("twin", __doc__)
    arguments.add_argument("--robot", default="butler")
    arguments.add_argument("--world", default="flat")
    arguments.add_argument("--rounds", type=int, default=15, help="interleaved rounds of each run")
    arguments.add_argument("--steps", type=int, default=500, help="physics steps per round")
    options = arguments.parse_args(argv)
    report = measure(options.robot, options.world, options.rounds, options.steps)
    show(report, as_json=options.json, text=_text)
    return 0


@contextmanager
def _busy_lockstep(robot: str, world: str, *, imu: bool) -> Iterator[Lockstep]:
    """Give a lock-step whose devices all work: torque on, goals followed, buses answered."""
    with tempfile.TemporaryDirectory() as folder:
        lockstep = Lockstep(robot, world, _SEED, tmp_path=Path(folder))
        if not imu:
            lockstep.twin.imu.due_ns = _NEVER_NS
        traffic = DeviceTraffic(lockstep)
        lockstep.add(traffic)
        traffic.await_motion(lockstep)
        yield lockstep
        lockstep.close()


@contextmanager
def _controlled_lockstep(robot: RobotDescription, world: str) -> Iterator[Lockstep]:
    with tempfile.TemporaryDirectory() as folder:
        lockstep = Lockstep(robot.name, world, _SEED, tmp_path=Path(folder))
        profile = load_profile(lockstep.context.profile)
        lockstep.add(ControlNode(lockstep.context, robot, profile, lockstep.devices))
        yield lockstep
        lockstep.close()


def _best_rates(
    runners: Mapping[str, Runner], rounds: int, steps: int, watches: Sequence[Stopwatch]
) -> dict[str, float]:
    """Return steps per second of CPU time of each runner."""
    for run in runners.values():
        run(_WARM_UP_STEPS)
    rates: dict[str, list[float]] = {name: [] for name in runners}
    for _ in range(rounds):
        for name, run in runners.items():
            started_s = time.thread_time()
            run(steps)
            rates[name].append(steps / (time.thread_time() - started_s))
        for watch in watches:
            watch.lap()
    return {name: max(values) for name, values in rates.items()}


def _step_raw(engine: Engine, count: int) -> None:
    for _ in range(count):
        mujoco.mj_step(engine.model, engine.data)


def _step_twin(twin: Twin, count: int) -> None:
    for _ in range(count):
        twin.step()


def _text(report: dict[str, Any]) -> str:
    return (
        f"raw mj_step           {report['raw_steps_per_s']:8.0f} steps/s\n"
        f"twin                  {report['twin_steps_per_s']:8.0f} steps/s, "
        f"{report['step_rate_ratio_vs_raw']:.2f} of raw, "
        f"{report['twin_real_time_factor']:.1f} x real time\n"
        f"lock-step + drivers   {report['real_time_factor']:8.1f} x real time, "
        f"mj_step {report['mj_step_cpu_ratio']:.0%} of the twin's CPU\n"
        f"lock-step + control   {report['control_real_time_factor']:8.1f} x real time"
    )


if __name__ == "__main__":
    sys.exit(main())
