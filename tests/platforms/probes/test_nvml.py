"""nvidia-ml-py really runs; only the driver's library below it is one of ours."""

import ctypes
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pynvml
import pytest

from platforms.probes import ProbeSet, open_probes
from platforms.probes.nvml import READS_BETWEEN_TRIALS

MIB = 1 << 20
PROCESSES = {4242: 300 * MIB, 4243: 100 * MIB}


class Driver:
    """Stands for libnvidia-ml.so.1: two GPUs alike, whose functions may be made to fail."""

    def __init__(self) -> None:
        self.failing: dict[str, int] = {}
        self.open = 0

    def functions(self) -> SimpleNamespace:
        named: dict[str, Callable[..., int]] = {
            "nvmlInitWithFlags": self._init,
            "nvmlShutdown": self._shut_down,
            "nvmlDeviceGetCount_v2": lambda count: self._put(count, value=2),
            "nvmlDeviceGetHandleByIndex_v2": lambda index, handle: 0,
            "nvmlDeviceGetUtilizationRates": lambda _, rates: self._put(rates, gpu=42),
            "nvmlDeviceGetMemoryInfo": lambda _, info: self._put(
                info, used=500 * MIB, total=8192 * MIB
            ),
            "nvmlDeviceGetPowerUsage": lambda _, power: self._put(power, value=75_500),
            "nvmlDeviceGetTemperature": lambda _, sensor, found: self._put(found, value=61),
            "nvmlDeviceGetComputeRunningProcesses_v3": self._processes,
        }
        return SimpleNamespace(
            nvmlErrorString=lambda number: b"Not Supported",
            **{name: self._fallible(name, function) for name, function in named.items()},
        )

    def _fallible(self, name: str, function: Callable[..., int]) -> Callable[..., int]:
        return lambda *arguments: self.failing.get(name) or function(*arguments)

    def _init(self, flags: int) -> int:
        self.open += 1
        return 0

    def _shut_down(self) -> int:
        self.open -= 1
        return 0

    @staticmethod
    def _put(reference: Any, **fields: int) -> int:
        for name, value in fields.items():
            setattr(reference._obj, name, value)
        return 0

    @staticmethod
    def _processes(device: Any, count: Any, array: Any) -> int:
        if array is None:
            count._obj.value = len(PROCESSES)
            return int(pynvml.NVML_ERROR_INSUFFICIENT_SIZE)
        count._obj.value = len(PROCESSES)
        for entry, (pid, size) in zip(array, PROCESSES.items(), strict=False):
            entry.pid, entry.usedGpuMemory = pid, size
        return 0


@pytest.fixture
def driver(monkeypatch: pytest.MonkeyPatch) -> Driver:
    driver = Driver()
    library = driver.functions()

    def load(name: str) -> SimpleNamespace:
        assert name == "libnvidia-ml.so.1"
        return library

    monkeypatch.setattr(pynvml, "CDLL", load)
    monkeypatch.setattr(pynvml, "nvmlLib", None)
    monkeypatch.setattr(pynvml, "_nvmlGetFunctionPointer_cache", {})
    return driver


@pytest.fixture
def probes(tmp_path: Path, driver: Driver) -> Iterator[ProbeSet]:
    with open_probes(tmp_path, nvml=True) as probes:
        yield probes


def test_load_memory_power_and_heat_come_from_the_driver(probes: ProbeSet) -> None:
    readings = probes.read()
    expected = {
        "gpu_load_ratio": 0.42,
        "gpu_memory_used_bytes": 1000 * MIB,
        "gpu_memory_total_bytes": 16384 * MIB,
        "gpu_memory_used_bytes.4242": 600 * MIB,
        "power_w.gpu1": 75.5,
        "temperature_c.gpu0": 61,
        "temperature_c": 61,
    }
    found = {name: readings[name].value for name in expected}
    assert found == pytest.approx(expected)


def test_a_gpu_that_shares_the_main_memory_is_judged_by_its_processes(
    probes: ProbeSet, driver: Driver
) -> None:
    driver.failing["nvmlDeviceGetMemoryInfo"] = pynvml.NVML_ERROR_NOT_SUPPORTED
    readings = probes.read()
    assert readings["gpu_memory_used_bytes"].value == 800 * MIB
    assert readings["gpu_memory_total_bytes"].value is None
    assert "Not Supported" in readings["gpu_memory_total_bytes"].reason


@pytest.mark.parametrize(
    ("function", "name"),
    [
        ("nvmlDeviceGetUtilizationRates", "gpu_load_ratio"),
        ("nvmlDeviceGetPowerUsage", "power_w.gpu0"),
        ("nvmlDeviceGetTemperature", "temperature_c.gpu0"),
    ],
)
def test_what_a_gpu_does_not_support_is_missing(
    probes: ProbeSet, driver: Driver, function: str, name: str
) -> None:
    driver.failing[function] = pynvml.NVML_ERROR_NOT_SUPPORTED
    reading = probes.read()[name]
    assert reading.value is None
    assert f"{function}: Not Supported" in reading.reason


def test_a_driver_that_is_loaded_late_is_found_after_a_while(
    probes: ProbeSet, driver: Driver
) -> None:
    driver.failing["nvmlInitWithFlags"] = pynvml.NVML_ERROR_DRIVER_NOT_LOADED
    assert probes.read()["gpu_load_ratio"].value is None
    driver.failing.clear()
    for _ in range(READS_BETWEEN_TRIALS - 1):
        assert probes.read()["gpu_load_ratio"].value is None
    assert probes.read()["gpu_load_ratio"].value == 0.42


def test_the_library_is_given_back(tmp_path: Path, driver: Driver) -> None:
    with open_probes(tmp_path, nvml=True) as probes:
        probes.read()
        assert driver.open == 1
    assert driver.open == 0


def test_without_the_drivers_library_the_reason_says_so(
    probes: ProbeSet, monkeypatch: pytest.MonkeyPatch
) -> None:
    def load(name: str) -> ctypes.CDLL:
        raise OSError(f"{name}: cannot open shared object file")

    monkeypatch.setattr(pynvml, "CDLL", load)
    reading = probes.read()["gpu_load_ratio"]
    assert reading.value is None
    assert "Not Found" in reading.reason


def test_without_the_package_the_reason_names_the_extra(
    probes: ProbeSet, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "pynvml", None)
    reading = probes.read()["gpu_load_ratio"]
    assert reading.value is None
    assert "pip install 'vla-deploy[nvml]'" in reading.reason


def test_a_devfreq_node_is_asked_before_the_driver(
    board_tree: Callable[[str], Path], driver: Driver
) -> None:
    with open_probes(board_tree("orin_nano_8gb_super"), nvml=True) as probes:
        readings = probes.read()
    assert readings["gpu_load_ratio"].value == pytest.approx(0.437)
    assert readings["power_w"].value == pytest.approx(4.984 * 1.512)
