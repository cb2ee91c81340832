"""LeRobot's own buses drive the emulated servos through a whole session, lerobot/session.py.

LeRobot needs a newer Python than ours and torch, so it has an environment of its own, the one that
`scripts/lerobot-check` makes; where there is none these tests are left out.
"""

import subprocess
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from drivers.clock import NS_PER_S, MonotonicClock
from sim_twin.servos import EmulatedServoSpec, WireTiming
from sim_twin.servos.feetech import EmulatedFeetechSpec
from sim_twin.servos.firmware.rail import SupplyVolts
from sim_twin.servos.server import FreeBank, FreeFeetechServos, FreeServos, serve
from vla_deploy.robots import load_robot

ROOT = Path(__file__).parents[3]
PYTHON = ROOT / ".venv-lerobot/bin/python"
SESSION = Path(__file__).parent / "lerobot/session.py"
CLOCK = MonotonicClock()
PACED = WireTiming(baud=1_000_000)


def has_lerobot() -> bool:
    """Return whether LeRobot's environment is there, with the vendors' SDKs that its buses use."""
    needed = "from importlib.util import find_spec as find; import sys; "
    needed += "sys.exit(not all(map(find, ('lerobot', 'scservo_sdk', 'dynamixel_sdk'))))"
    return PYTHON.exists() and subprocess.run([PYTHON, "-c", needed], check=False).returncode == 0


pytestmark = [
    pytest.mark.skipif(
        not has_lerobot(),
        reason="no LeRobot with its SDKs in .venv-lerobot: see scripts/lerobot-check",
    ),
    pytest.mark.timeout(120),
]


def servos(family: str) -> tuple[FreeBank, FreeBank]:
    """Return the servos of an arm, and a new one as it is delivered."""
    if family == "feetech":
        arm = load_robot("so101").servo_bus.servos
        specs = [EmulatedFeetechSpec(id=one.id, model_name=one.model) for one in arm]
        new = EmulatedFeetechSpec(id=1, model_name=arm[-1].model)
        return FreeFeetechServos(specs, timing=PACED), FreeFeetechServos([new], timing=PACED)
    arm = load_robot("koch_v1_1").servo_bus.servos
    own = [EmulatedServoSpec(id=n.id, model_name=n.model, eeprom={"baud_rate": 3}) for n in arm]
    one = EmulatedServoSpec(id=1, model_name=arm[-1].model)
    return FreeServos(own, timing=PACED), FreeServos([one], timing=PACED)


@contextmanager
def served(free: FreeBank, link: Path) -> Iterator[Path]:
    stop = threading.Event()
    thread = threading.Thread(target=serve, args=(free, link, CLOCK, stop.is_set))
    thread.start()
    try:
        yield link
    finally:
        stop.set()
        thread.join()


def cut_power(free: FreeBank) -> None:
    """Switch the supply off and on again."""
    supply_v: SupplyVolts = free.supply_v
    for volts in (0.0, supply_v):
        free.supply_v = volts
        CLOCK.sleep_until(CLOCK.now_ns() + NS_PER_S // 5)


@pytest.mark.parametrize("family", ["feetech", "dynamixel"])
def test_a_whole_session_of_lerobot_works(tmp_path: Path, family: str) -> None:
    arm, new = servos(family)
    with served(arm, tmp_path / "arm") as port, served(new, tmp_path / "new") as new_port:
        command = [PYTHON, "-W", "ignore", SESSION, family, port, new_port]
        with subprocess.Popen(
            command,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        ) as session:
            assert session.stdin is not None and session.stdout is not None
            assert session.stderr is not None
            said = []
            for line in session.stdout:
                said.append(words := line.split())
                match words:
                    case ["overload" | "relieve" as act, servo_id]:
                        arm.bank.overload(int(servo_id), on=act == "overload")
                    case ["power"]:
                        cut_power(arm)
                    case _:
                        continue
                session.stdin.write("done\n")
                session.stdin.flush()
            errors = session.stderr.read()
    assert said[-1:] == [["all", "done"]], errors
