"""Record the example flights anew, after the rules or their inputs were changed on purpose.

.venv/bin/python tests/vla_deploy/telemetry/make_flights.py

Each is a short life of control in the twin, in lock-step: same code, same bytes.
"""

import shutil
import sys
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path

from sim_twin.harness.lockstep_stack import LockstepControl
from vla_deploy.telemetry.folder import FlightFolder
from vla_deploy.telemetry.node import RecorderNode
from vla_deploy.telemetry.triggers import Debounce

FLIGHTS = Path(__file__).parent / "flights"
_WALL_NS = 1_800_000_000_000_000_000


def drive(stack: LockstepControl, seconds: float, w_rad_s: float = 0.2) -> None:
    """Drive a curve, or with no turning straight ahead."""
    stack.drive_for(seconds, 0.3, w_rad_s)


def reach(stack: LockstepControl, seconds: float, **targets: float) -> None:
    """Move joints."""
    stack.go(targets)
    stack.lockstep.run_for(seconds)


def estop_while_driving(stack: LockstepControl) -> None:
    """Press stop at full speed, reset, arm."""
    stack.add_senses()
    drive(stack, 0.5)
    stack.operate("estop")
    drive(stack, 0.5)
    stack.operate("reset")
    stack.lockstep.run_for(0.1)


def servo_bus_unplugged(stack: LockstepControl) -> None:
    """Pull the servos' plug while an arm reaches."""
    reach(stack, 0.3, left_elbow=1.6, head_pan=0.5)
    stack.faults.inject("servo_bus", None, "unplug")
    stack.lockstep.run_for(0.6)


def wheel_blocked(stack: LockstepControl) -> None:
    """Block a wheel while the base drives."""
    stack.add_senses()
    drive(stack, 0.3)
    stack.faults.inject("drive", "left_wheel", "stuck")
    drive(stack, 0.8)


def zone_entered_and_left(stack: LockstepControl) -> None:
    """Hold a box before the base, where the lidar sees it, then take it away."""
    stack.add_senses()
    drive(stack, 0.8, w_rad_s=0.0)
    engine = stack.lockstep.twin.engine
    x_m, y_m, _ = engine.data.body("base").xpos
    for ahead_m in [0.5] * 25 + [3.0] * 25:
        engine.place("box", float(x_m) + ahead_m, float(y_m), 0.12, 0.0)
        drive(stack, 0.02, w_rad_s=0.0)


def arm_blocked(stack: LockstepControl) -> None:
    """Block an arm by a hard stop; reset and arm once it has eased off."""
    reach(stack, 0.8, left_shoulder_pitch=1.5, left_elbow=0.6)
    model, data = stack.lockstep.twin.engine.model, stack.lockstep.twin.engine.data
    joint = model.joint("left_shoulder_pitch")
    model.jnt_range[joint.id][1] = data.qpos[joint.qposadr[0]]
    stack.lockstep.run_for(1.0)
    for act in ("reset", "arm"):
        stack.operate(act)
        stack.lockstep.run_for(0.1)


def arm_into_body(stack: LockstepControl) -> None:
    """Send an arm into the robot's own body: their clearance ends it before they touch."""
    reach(stack, 1.2, left_shoulder_yaw=-1.17, left_shoulder_pitch=1.2, left_elbow=1.5)


SCENES: Mapping[str, Callable[[LockstepControl], None]] = {
    "estop_while_driving": estop_while_driving,
    "servo_bus_unplugged": servo_bus_unplugged,
    "wheel_blocked": wheel_blocked,
    "zone_entered_and_left": zone_entered_and_left,
    "arm_blocked": arm_blocked,
    "arm_into_body": arm_into_body,
}


def record(name: str, to: Path) -> None:
    """Record one scene from control's first tick on."""
    with tempfile.TemporaryDirectory() as directory:
        # A run's directory carries its name.
        run_dir = Path(directory) / name
        run_dir.mkdir()
        stack, folder = LockstepControl(run_dir), FlightFolder(Path(directory) / "flights")
        clock = stack.lockstep.clock
        # Only the request at the end saves: one file for all that happens.
        debounce = Debounce(gap_s=3600.0, longest_s=3600.0)
        recorder = RecorderNode(
            stack.lockstep.context, folder, lambda: _WALL_NS + clock.now_ns(), debounce
        )
        stack.lockstep.add(recorder)
        stack.arm()
        SCENES[name](stack)
        stack.space.ring_writer("flight_request").publish({"source": "example", "reason": name})
        if not stack.lockstep.run_until(lambda: bool(folder.files()), 30.0):
            sys.exit(f"{name}: no flight was written")
        shutil.copyfile(folder.find("latest"), to)
        stack.close()


if __name__ == "__main__":
    FLIGHTS.mkdir(exist_ok=True)
    for scene in sys.argv[1:] or SCENES:
        record(scene, FLIGHTS / f"{scene}.mcap")
        print(FLIGHTS / f"{scene}.mcap")
