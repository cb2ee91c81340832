import numpy as np
import pytest

from sim_twin.pictures.mirror import MirrorState, mirror_pair, newest_state, send_state


def state(now_ns: int) -> MirrorState:
    return MirrorState(now_ns=now_ns, clock_ns=7, qpos=np.array([1.0, 2.0]))


def test_only_the_newest_state_arrives() -> None:
    sender, receiver = mirror_pair()
    with sender, receiver:
        send_state(sender, state(1))
        send_state(sender, state(2))
        newest = newest_state(receiver)
        assert newest is not None
        assert (newest.now_ns, newest.clock_ns, newest.qpos.tolist()) == (2, 7, [1.0, 2.0])
        assert newest_state(receiver) is None


def test_a_receiver_that_sleeps_never_holds_up_the_sender() -> None:
    sender, receiver = mirror_pair()
    with sender, receiver:
        for now_ns in range(10_000):
            send_state(sender, state(now_ns))
        assert newest_state(receiver) is not None


def test_the_senders_end_is_noticed() -> None:
    sender, receiver = mirror_pair()
    sender.close()
    with receiver, pytest.raises(EOFError):
        newest_state(receiver)


def test_the_receivers_end_is_noticed() -> None:
    sender, receiver = mirror_pair()
    receiver.close()
    with sender, pytest.raises(BrokenPipeError):
        send_state(sender, state(1))
