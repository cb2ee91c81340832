"""Copy the physics' state to a process that only draws it; old states are dropped, never queued."""

import json
import socket
import struct
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

READY = b"ready"
"""What a drawing process sends back once it draws; anything else is why it cannot."""
_HEAD = struct.Struct("<qqI")
_MAX_STATE_BYTES = 65_536


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MirrorState:
    """Hold one moment: both times, all positions, the camera's faults, and what is switched on."""

    now_ns: int
    clock_ns: int
    qpos: NDArray[np.float64]
    camera_faults: str = "[]"
    switched_on: tuple[str, ...] = ()


def mirror_pair() -> tuple[socket.socket, socket.socket]:
    """Return the two ends of a mirror; states go from the first to the second."""
    sender, receiver = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    sender.setblocking(False)
    receiver.setblocking(False)
    return sender, receiver


def send_state(sender: socket.socket, state: MirrorState) -> None:
    """Send one state, or drop it when the receiver is behind.

    Raises:
        BrokenPipeError: the receiver has ended.
    """
    try:
        head = _HEAD.pack(state.now_ns, state.clock_ns, len(state.qpos))
        rest = json.dumps([state.camera_faults, state.switched_on])
        sender.send(head + state.qpos.tobytes() + rest.encode())
    except BlockingIOError:
        return


def newest_state(receiver: socket.socket) -> MirrorState | None:
    """Return the newest state that has arrived, or None.

    Raises:
        EOFError: the sender has ended.
    """
    newest = None
    while True:
        try:
            packet = receiver.recv(_MAX_STATE_BYTES)
        except BlockingIOError:
            break
        if not packet:
            raise EOFError("the twin has ended")
        newest = packet
    if newest is None:
        return None
    now_ns, clock_ns, count = _HEAD.unpack_from(newest)
    qpos = np.frombuffer(newest, np.float64, count, offset=_HEAD.size)
    faults, switched_on = json.loads(newest[_HEAD.size + qpos.nbytes :])
    return MirrorState(
        now_ns=now_ns,
        clock_ns=clock_ns,
        qpos=qpos,
        camera_faults=faults,
        switched_on=tuple(switched_on),
    )
