"""Ask for a viewer: one that is there is used, and one that cannot be says why."""

import socket

import pytest

from drivers.clock import MonotonicClock
from vla_deploy.telemetry.errors import ExtraMissing
from vla_deploy.telemetry.rerun.viewer import open_viewer, url_of


def test_a_viewer_that_is_open_is_used() -> None:
    with socket.create_server(("127.0.0.1", 0)) as viewer:
        port = viewer.getsockname()[1]
        open_viewer(port, MonotonicClock())
        assert url_of(port) == f"rerun+http://127.0.0.1:{port}/proxy"
        asked, _ = viewer.accept()
        with asked:
            assert asked.recv(1) == b""  # somebody looked whether it listens, and no more


def test_where_there_is_no_screen_or_no_rerun_a_file_is_proposed(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    for name in ("DISPLAY", "WAYLAND_DISPLAY", "WAYLAND_SOCKET"):
        monkeypatch.delenv(name, raising=False)
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    with pytest.raises(ExtraMissing, match=r"no viewer .*(rerun|DISPLAY).* --save out\.rrd"):
        open_viewer(port, MonotonicClock())
