"""Press the stop of real processes in one way or another, and time it to the frame on the wire."""

import random
import socket
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from typing import Final

from sim_twin.harness.processes import ProcessStack
from sim_twin.harness.robot import RobotFailed
from sim_twin.harness.stop_witness import ANSWER_S, NoStop, StopWitness

_PATHS: Final = {"page": "/api/v1/stop", "door": "/stop"}
_NS_PER_MS: Final = 1e6
_START_S: Final = 90.0


class StopPresser:
    """Arm, press in some way, and see when the wire tells."""

    def __init__(self, robot: ProcessStack, draw: random.Random) -> None:
        self.robot = robot
        self._draw = draw
        self._witness = StopWitness(robot.run_dir)

    def address(self, door: str) -> tuple[str, int]:
        """Return where a door was told to be, also once it is gone.

        Raises:
            NoStop: it has never said so.
        """
        topic = {"page": "dashboard_status", "door": "stop_door_status"}[door]
        if not self.robot.wait_until(lambda: self.robot.document(topic), _START_S):
            raise NoStop(f"nobody tells where the {door} is; see `vla-deploy status`")
        return "127.0.0.1", int(self.robot.document(topic)["port"])

    def presses(
        self, count: int, doors: Sequence[str], goes_on: Callable[[], bool] = lambda: True
    ) -> list[float]:
        """Return how long each press of these doors took, in ms; those that were not are left out.

        Raises:
            NoStop: a press had no effect.
        """
        pressed = (self._press(doors) for _ in range(count) if goes_on())
        return [time_ms for time_ms in pressed if time_ms is not None]

    def timed(
        self, press: Callable[[ExitStack], object], answer_s: float = ANSWER_S
    ) -> float | None:
        """Return how long a press took to the wire, in ms; what it opens closes after that.

        The busy machine itself may stop the robot before, or keep it from being armed again: then
        nothing is pressed, and None is returned.

        Raises:
            NoStop: the press had no effect within `answer_s`.
        """
        if not self._is_armed() or not self._witness.operates():
            return None
        with ExitStack() as opened:
            asked_ns = self.robot.clock.now_ns()
            press(opened)
            time_ms = (self._witness.stop_frame_ns(answer_s) - asked_ns) / _NS_PER_MS
            self.robot.await_change("armed")
        return time_ms

    def close(self) -> None:
        """Leave the bus."""
        self._witness.close()

    def _press(self, doors: Sequence[str]) -> float | None:
        addresses = {door: self.address(door) for door in doors}

        def press(opened: ExitStack) -> None:
            for door, address in addresses.items():
                send_press(opened, door, address)

        return self.timed(press)

    def _is_armed(self) -> bool:
        try:
            self.robot.arm()
        except RobotFailed:
            return False
        self.robot.pause(self._draw.uniform(0.02, 0.1))
        return True


def send_press(opened: ExitStack, door: str, address: tuple[str, int]) -> None:
    """Send a press without waiting for anything; who is gone refuses it."""
    client = opened.enter_context(socket.socket())
    host = f"{address[0]}:{address[1]}"
    head = f"POST {_PATHS[door]} HTTP/1.1\r\nHost: {host}\r\nContent-Length: 0\r\n\r\n"
    try:
        client.connect(address)  # the kernel answers for a process that is frozen
        client.sendall(head.encode())
    except ConnectionError:
        return  # as after a kill: the other door is pressed, too
