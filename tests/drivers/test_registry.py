"""A sensor's model selects driver and line speed; an unknown one is refused with the known ones."""

import subprocess
import sys

import pytest

from drivers.camera.rgbd_stream import RgbdCamera
from drivers.errors import DriverError, UnknownModel
from drivers.estop.open_estop import open_estop
from drivers.imu.bno085_rvc import Bno085Rvc
from drivers.lidar.ld19 import Ld19
from drivers.opener import PathOpener
from drivers.registry import (
    MODELS,
    SensorKind,
    model_names,
    open_camera,
    open_imu,
    open_lidar,
    sensor_model,
)
from sim_twin.contracts.scripted import ManualClock, ScriptedLine

LINE, CLOCK = ScriptedLine(), ManualClock()


@pytest.mark.parametrize(("kind", "model"), MODELS)
def test_every_model_has_a_driver_that_keeps_its_kinds_shape(kind: SensorKind, model: str) -> None:
    opened = {
        SensorKind.LIDAR: lambda: open_lidar(model, LINE, CLOCK),
        SensorKind.IMU: lambda: open_imu(model, LINE, CLOCK),
        SensorKind.CAMERA: lambda: open_camera(model, LINE, CLOCK, rate_hz=10.0),
    }[kind]()
    assert opened.counters is not None
    assert not opened.poll()
    opened.close()


def test_the_models_are_driven_by_the_classes_of_their_names() -> None:
    assert isinstance(open_lidar("LD19", LINE, CLOCK), Ld19)
    assert isinstance(open_imu("BNO085-RVC", LINE, CLOCK), Bno085Rvc)
    assert isinstance(open_camera("RGBD-STREAM", LINE, CLOCK, rate_hz=5.0), RgbdCamera)
    # A stream in the place of a video device, as the twin serves it.
    assert isinstance(open_camera("V4L2", LINE, CLOCK, rate_hz=5.0), RgbdCamera)
    assert sensor_model(SensorKind.LIDAR, "LD19").baud == 230_400
    assert sensor_model(SensorKind.IMU, "BNO085-RVC").baud == 115_200


@pytest.mark.parametrize("kind", SensorKind)
def test_an_unknown_model_is_refused_with_the_known_ones(kind: SensorKind) -> None:
    with pytest.raises(UnknownModel, match=f"{kind.value} 'X1'") as caught:
        sensor_model(kind, "X1")
    assert all(name in str(caught.value) for name in model_names(kind))
    assert isinstance(caught.value, DriverError)


def test_an_unknown_button_is_refused_with_the_known_ones() -> None:
    opener = PathOpener({}, CLOCK)
    with pytest.raises(UnknownModel, match=r"'ROPE'.*HID, GPIO"):
        open_estop("ROPE", opener, "estop", CLOCK, number=1)


def test_control_pays_for_no_camera() -> None:
    heavy = "[name for name in ('cv2', 'gpiod', 'sounddevice') if name in sys.modules]"
    ran = subprocess.run(
        [sys.executable, "-c", f"import sys, vla_deploy.control.node; print({heavy})"],
        capture_output=True,
        text=True,
        check=True,
    )
    assert ran.stdout.strip() == "[]"
