"""Run the CAN commands as a person does, on emulated drives behind a hub."""

import json
import threading
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import pytest

from drivers.clock import NS_PER_S, MonotonicClock
from sim_twin.can import CanHub, CanWire, WheelDrive
from sim_twin.can.emulated_drive import EmulatedDrive
from sim_twin.can.odrive.axis import ODriveAxis

CLOCK = MonotonicClock()


class ServedBus:
    """Drives on a hub, served by a thread."""

    def __init__(self, path: Path, drives: Sequence[EmulatedDrive]) -> None:
        self.path = str(path)
        self._drives = drives
        self._wire = CanWire(drives)
        self._hub = CanHub(self._wire, path)
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._serve)
        self._thread.start()

    def _serve(self) -> None:
        while not self._stop.is_set():
            self._hub.poll_once()
            now_ns = CLOCK.now_ns()
            for drive in self._drives:
                drive.advance(now_ns, 0.0, 0.0)
            self._wire.poll(now_ns)
            CLOCK.sleep_until(now_ns + NS_PER_S // 1000)

    def close(self) -> None:
        self._stop.set()
        self._thread.join()
        self._hub.close()


@pytest.fixture
def make_bus(tmp_path: Path) -> Iterator[Callable[..., ServedBus]]:
    buses: list[ServedBus] = []

    def make(*drives: EmulatedDrive) -> ServedBus:
        buses.append(ServedBus(tmp_path / f"can{len(buses)}", drives))
        return buses[-1]

    yield make
    for bus in buses:
        bus.close()


@pytest.fixture
def on(vla: Callable[..., Any]) -> Callable[..., Any]:
    """Run a CAN command on a bus."""

    def on(bus: ServedBus, command: str, *words: str) -> Any:
        return vla("can", command, "--interface", "vla_hub", "--channel", bus.path, *words)

    return on


def test_a_scan_finds_canopen_nodes_with_their_identity(
    make_bus: Callable[..., ServedBus], on: Callable[..., Any]
) -> None:
    bus = make_bus(WheelDrive(5), WheelDrive(126))
    found = on(bus, "scan", "--json").document
    assert [node["node_id"] for node in found["canopen"]] == [5, 126]
    assert found["canopen"][0]["profile"] == 402
    assert found["canopen"][0]["vendor"] == 0x564C4144
    assert found["odrive"] == []
    assert found["silent_nodes_were_asked"] is True


def test_a_scan_finds_odrive_axes_and_asks_no_silent_node(
    make_bus: Callable[..., ServedBus], on: Callable[..., Any]
) -> None:
    axis = ODriveAxis(48)
    bus = make_bus(axis, ODriveAxis(0))
    code, told, _ = on(bus, "scan")
    assert code == 0
    assert "ODrive axis    0: firmware 0.0.0, IDLE, errors none" in told
    assert "ODrive axis   48" in told
    assert "silent CANopen nodes were not asked" in told
    assert not axis.errors


def test_a_scan_of_an_empty_bus_fails_with_a_remedy(
    make_bus: Callable[..., ServedBus], on: Callable[..., Any]
) -> None:
    code, _, error = on(make_bus(), "scan", "--protocol", "odrive")
    assert code == 1
    assert "nobody answers at 1000000 bit/s" in error


def frames_of(text: str) -> list[dict[str, Any]]:
    return [json.loads(line) for line in text.splitlines()]


def test_the_monitor_prints_odrive_traffic_by_name(
    make_bus: Callable[..., ServedBus], on: Callable[..., Any]
) -> None:
    bus = make_bus(ODriveAxis(3))
    frames = frames_of(on(bus, "monitor", "--protocol", "odrive", "--count", "20", "--json").out)
    assert len(frames) == 20
    assert {frame["kind"] for frame in frames} == {"Heartbeat", "Get_Encoder_Estimates"}
    assert {frame["node"] for frame in frames} == {3}
    beat = next(frame for frame in frames if frame["kind"] == "Heartbeat")
    assert "Axis_Error none, Axis_State IDLE" in beat["text"]


def test_the_monitor_prints_canopen_traffic_in_words_and_ends_in_time(
    make_bus: Callable[..., ServedBus], on: Callable[..., Any]
) -> None:
    drive = WheelDrive(1)
    bus = make_bus(drive)
    fault = threading.Timer(0.5, drive.raise_fault, (0x4310, 0x09))
    fault.start()
    code, told, _ = on(bus, "monitor", "--seconds", "1.0")
    fault.join()
    assert code == 0
    assert "EMCY 1  0x4310 drive over-temperature, error register 0x09" in told


@pytest.mark.parametrize("chosen", [["--node", "3"], ["--id", "0x61"], ["--id", "97"]])
def test_the_monitor_prints_only_what_it_is_asked_for(
    make_bus: Callable[..., ServedBus], on: Callable[..., Any], chosen: list[str]
) -> None:
    bus = make_bus(ODriveAxis(2), ODriveAxis(3))
    said = on(bus, "monitor", "--protocol", "odrive", "--count", "3", "--json", *chosen)
    assert {frame["node"] for frame in frames_of(said.out)} == {3}
