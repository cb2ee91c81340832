"""Measure what the emulated devices cost on top of the physics, and how fast lock-step runs.

Three runs of the same robot in the same world take turns, so that a busy machine hits all of them;
medians are compared: raw `mj_step`; the twin (16 servos, two drives, 360-beam lidar, IMU; no
camera); and lock-step with the real control node on its buses, disarmed, at the profile's rate.
"""

import argparse
import json
import statistics
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Final

import mujoco

from platforms import load_profile
from sim_twin.compose import STEP_S
from sim_twin.engine import Engine
from sim_twin.load import load_engine
from sim_twin.lockstep import Lockstep
from sim_twin.twin import Twin
from vla_deploy.control.node import ControlNode
from vla_deploy.robots import RobotDescription, load_robot

_SEED: Final = 0
_WARM_UP_STEPS: Final = 200


def measure(robot_name: str, world: str, rounds: int, steps: int) -> dict[str, Any]:
    """Return step rates, their ratio and real-time factors; medians over the rounds."""
    robot = load_robot(robot_name)
    engine = load_engine(robot, world, _SEED)
    twin = Twin(robot, world, _SEED)
    with tempfile.TemporaryDirectory() as folder:
        lockstep = _lockstep(robot_name, robot, world, Path(folder))
        runners: dict[str, Callable[[int], None]] = {
            "raw": lambda count: _step_raw(engine, count),
            "twin": lambda count: _step_twin(twin, count),
            "lockstep": lambda count: lockstep.run_for(count * STEP_S),
        }
        rates = _median_rates(runners, rounds, steps)
        lockstep.close()
    return {
        "robot": robot_name,
        "world": world,
        "rounds": rounds,
        "steps_per_round": steps,
        "raw_steps_per_s": rates["raw"],
        "twin_steps_per_s": rates["twin"],
        "step_rate_ratio_vs_raw": rates["twin"] / rates["raw"],
        "twin_real_time_factor": rates["twin"] * STEP_S,
        "real_time_factor": rates["lockstep"] * STEP_S,
    }


def main(argv: Sequence[str] | None = None) -> int:
    """Print the comparison."""
    parser = argparse.ArgumentParser(prog="bench twin", description=__doc__)
    parser.add_argument("--robot", default="butler")
    parser.add_argument("--world", default="flat")
    parser.add_argument("--rounds", type=int, default=7, help="interleaved rounds of each run")
    parser.add_argument("--steps", type=int, default=500, help="physics steps per round")
    parser.add_argument("--json", action="store_true", help="print JSON")
    options = parser.parse_args(argv)
    report = measure(options.robot, options.world, options.rounds, options.steps)
    print(json.dumps(report, indent=2) if options.json else _text(report))
    return 0


def _lockstep(name: str, robot: RobotDescription, world: str, folder: Path) -> Lockstep:
    lockstep = Lockstep(name, world, _SEED, tmp_path=folder)
    profile = load_profile(lockstep.context.profile)
    lockstep.add(ControlNode(lockstep.context, robot, profile, lockstep.devices))
    return lockstep


def _median_rates(
    runners: dict[str, Callable[[int], None]], rounds: int, steps: int
) -> dict[str, float]:
    """Return steps per wall second of each runner."""
    for run in runners.values():
        run(_WARM_UP_STEPS)
    rates: dict[str, list[float]] = {name: [] for name in runners}
    for _ in range(rounds):
        for name, run in runners.items():
            started_s = time.perf_counter()
            run(steps)
            rates[name].append(steps / (time.perf_counter() - started_s))
    return {name: statistics.median(values) for name, values in rates.items()}


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
        f"lock-step + control   {report['real_time_factor']:8.1f} x real time"
    )


if __name__ == "__main__":
    sys.exit(main())
