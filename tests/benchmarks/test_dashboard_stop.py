import socket
from contextlib import ExitStack, closing

import pytest

from benchmarks.dashboard_stop import NoStop, _figures
from sim_twin.harness.stop_presser import send_press


def test_the_figures_are_those_of_the_sorted_times():
    assert _figures("both", [7.0, 5.0, 6.0]) == {
        "both_presses": 3,
        "both_to_frame_ms_p50": 6.0,
        "both_to_frame_ms_p99": 7.0,
        "both_to_frame_ms_max": 7.0,
    }


def test_a_way_without_any_press_is_no_success():
    with pytest.raises(NoStop, match="blocked: the robot stopped by itself before each press"):
        _figures("blocked", [])


def test_a_press_waits_for_nobody_and_outlives_a_door_that_is_gone():
    with closing(socket.create_server(("127.0.0.1", 0))) as frozen, ExitStack() as opened:
        address = frozen.getsockname()
        send_press(opened, "page", address)
        client, _ = frozen.accept()
        with closing(client):
            assert client.recv(100).startswith(b"POST /api/v1/stop HTTP/1.1\r\n")
    with ExitStack() as opened:
        send_press(opened, "door", address)
