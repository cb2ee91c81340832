from pathlib import Path

import pytest

from drivers.can_hub import HubBus
from drivers.can_interface import open_can_bus
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


def test_a_missing_interface_says_how_to_bring_it_up() -> None:
    with pytest.raises(DeviceMissing, match="ip link set nocan7 up type can bitrate 1000000"):
        open_can_bus("nocan7")
