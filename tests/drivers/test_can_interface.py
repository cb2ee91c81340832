import errno
import os
from pathlib import Path

import can
import pytest

from drivers.can.interface import open_can_bus
from drivers.can_hub import HubBus
from drivers.errors import DeviceMissing
from sim_twin.can import CanHub, CanWire


def test_a_path_opens_the_hub(tmp_path: Path) -> None:
    hub = CanHub(CanWire(), tmp_path / "can")
    with open_can_bus(str(tmp_path / "can")) as bus:
        assert isinstance(bus, HubBus)
    hub.close()


def test_a_path_without_a_hub_says_what_to_start(tmp_path: Path) -> None:
    with pytest.raises(DeviceMissing, match="start the twin first"):
        open_can_bus(str(tmp_path / "can"))


def failing(monkeypatch: pytest.MonkeyPatch, number: int) -> None:
    def refuse(**options: object) -> can.BusABC:
        raise OSError(number, os.strerror(number))

    monkeypatch.setattr(can, "Bus", refuse)


def test_a_missing_interface_says_how_to_bring_it_up(monkeypatch: pytest.MonkeyPatch) -> None:
    failing(monkeypatch, errno.ENODEV)
    with pytest.raises(
        DeviceMissing, match="ip link set can7 up type can bitrate 500000 restart-ms 100"
    ):
        open_can_bus("can7", 500_000)


def test_a_kernel_without_can_says_what_to_load_or_take(monkeypatch: pytest.MonkeyPatch) -> None:
    failing(monkeypatch, errno.EAFNOSUPPORT)
    with pytest.raises(DeviceMissing, match=r"modprobe can_raw.*slcan:/dev"):
        open_can_bus("can0")


class OpenBus(can.BusABC):  # type: ignore[misc]
    """An interface that opens."""

    def __init__(self, channel: str) -> None:
        super().__init__(channel=channel)

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        raise NotImplementedError


def test_an_interface_that_is_down_is_detected_without_netlink(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(can, "Bus", lambda **options: OpenBus(options["channel"]))
    (tmp_path / "can0").mkdir()
    state = tmp_path / "can0" / "operstate"
    state.write_text("down\n")
    with pytest.raises(DeviceMissing, match="is down or bus-off"):
        open_can_bus("can0", sysfs_net=tmp_path)
    state.write_text("up\n")
    open_can_bus("can0", sysfs_net=tmp_path).shutdown()


def test_a_serial_adapter_that_is_not_there_is_named(tmp_path: Path) -> None:
    with pytest.raises(DeviceMissing, match="see /dev/serial/by-id"):
        open_can_bus(f"slcan:{tmp_path}/none")
