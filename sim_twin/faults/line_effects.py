"""Declare what may befall a device's line: the servo bus, the lidar, the IMU, the camera."""

from collections.abc import Callable
from typing import Final, TypeVar

from sim_twin.errors import FaultRefused
from sim_twin.faults.effect import Effect, Ending, FaultParameter, Target
from sim_twin.faults.line_tamper import Garbage, Latency, LineTamper, Silence, Stuck, Tampering
from sim_twin.faults.plug import Plug
from sim_twin.faults.vocabulary import Component, Fault

LineOf = Callable[[Target], LineTamper]
PlugOf = Callable[[Target], Plug]
Declared = TypeVar("Declared")
Rows = dict[tuple[Component, Fault], Effect]

DELAY: Final = FaultParameter(
    name="delay_s", default=0.5, low=0.001, high=60.0, meaning="how late everything comes"
)


def line_rows(component: Component, line: LineOf, plug: PlugOf) -> Rows:
    """Return the faults that every line can have."""
    return {
        (component, Fault.OFF): Effect(
            summary="silent and deaf", begin=lambda target: _tamper(line(target), Silence())
        ),
        (component, Fault.STUCK): Effect(
            summary="repeats its last frame for ever",
            begin=lambda target: _tamper(line(target), Stuck(line(target))),
        ),
        (component, Fault.GARBAGE): Effect(
            summary="random bytes in place of what it says",
            begin=lambda target: _tamper(line(target), Garbage(target.seed)),
        ),
        (component, Fault.DELAYED): Effect(
            summary="what it says comes late",
            begin=lambda target: _tamper(line(target), Latency(target.values["delay_s"])),
            parameters=(DELAY,),
        ),
        (component, Fault.UNPLUG): Effect(
            summary="the cable is out", begin=lambda target: _pull(plug(target))
        ),
    }


def _tamper(line: LineTamper, tampering: Tampering) -> Ending:
    line.add(tampering)
    return lambda: line.remove(tampering)


def _pull(plug: Plug) -> Ending:
    plug.pull()
    return plug.push


def _lidar_line(target: Target) -> LineTamper:
    return target.twin.lines[target.twin.robot.lidar.device]


def _lidar_plug(target: Target) -> Plug:
    return target.twin.plugs[target.twin.robot.lidar.device]


def _imu_line(target: Target) -> LineTamper:
    return target.twin.lines[target.twin.robot.imu.device]


def _imu_plug(target: Target) -> Plug:
    return target.twin.plugs[target.twin.robot.imu.device]


def _camera_line(target: Target) -> LineTamper:
    return target.twin.camera_line


def _camera_plug(target: Target) -> Plug:
    return target.twin.plugs[target.twin.robot.camera.device]


def _change(device: object, attribute: str, value: float) -> Ending:
    usual = getattr(device, attribute)
    setattr(device, attribute, value)
    return lambda: setattr(device, attribute, usual)


def _wrong_ranges(target: Target) -> Ending:
    return _change(target.twin.lidar, "range_ratio", target.values["ratio"])


def _wrong_yaw(target: Target) -> Ending:
    return _change(target.twin.imu, "runaway_rad_s", target.values["rate_rad_s"])


def _wrong_depth(target: Target) -> Ending:
    return _change(target.twin.camera.device, "depth_ratio", target.values["ratio"])


def _slow_lidar(target: Target) -> Ending:
    lidar = target.twin.lidar
    return _change(lidar, "rate_hz", lidar.rate_hz * target.values["ratio"])


def _slow_imu(target: Target) -> Ending:
    imu = target.twin.imu
    return _change(imu, "rate_hz", imu.rate_hz * target.values["ratio"])


def _slow_camera(target: Target) -> Ending:
    return _change(target.twin.camera.device, "rate_ratio", target.values["ratio"])


def _estop_plug(target: Target) -> Plug:
    return target.twin.plugs[_declared(target.twin.robot.estop, "emergency-stop button").device]


def _microphone_line(target: Target) -> LineTamper:
    return target.twin.stream_lines[_declared(target.twin.robot.microphone, "microphone").device]


def _microphone_plug(target: Target) -> Plug:
    return target.twin.plugs[_declared(target.twin.robot.microphone, "microphone").device]


def _speaker_line(target: Target) -> LineTamper:
    return target.twin.stream_lines[_declared(target.twin.robot.speaker, "speaker").device]


def _speaker_plug(target: Target) -> Plug:
    return target.twin.plugs[_declared(target.twin.robot.speaker, "speaker").device]


def _declared(device: Declared | None, what: str) -> Declared:
    if device is None:
        raise FaultRefused(f"this robot's file declares no {what}")
    return device


def _press(target: Target) -> Ending:
    button = target.twin.estop_button
    button.press()
    return button.release


_SLOW: Final = FaultParameter(
    name="ratio", default=0.2, low=0.001, high=0.999, meaning="share of the usual rate"
)
_SCALE: Final = FaultParameter(
    name="ratio", default=0.5, low=0.01, high=10.0, meaning="told over true distance"
)
_TURN: Final = FaultParameter(
    name="rate_rad_s", default=0.5, low=-10.0, high=10.0, meaning="how fast yaw runs away"
)

SENSOR_ROWS: Final[Rows] = {
    **line_rows(Component.LIDAR, _lidar_line, _lidar_plug),
    (Component.LIDAR, Fault.WRONG): Effect(
        summary="every range scaled", begin=_wrong_ranges, parameters=(_SCALE,)
    ),
    (Component.LIDAR, Fault.SLOW): Effect(
        summary="the head turns slowly", begin=_slow_lidar, parameters=(_SLOW,)
    ),
    **line_rows(Component.IMU, _imu_line, _imu_plug),
    (Component.IMU, Fault.WRONG): Effect(
        summary="yaw turns although nothing does", begin=_wrong_yaw, parameters=(_TURN,)
    ),
    (Component.IMU, Fault.SLOW): Effect(
        summary="fewer frames", begin=_slow_imu, parameters=(_SLOW,)
    ),
    **line_rows(Component.CAMERA, _camera_line, _camera_plug),
    (Component.CAMERA, Fault.WRONG): Effect(
        summary="every depth scaled", begin=_wrong_depth, parameters=(_SCALE,)
    ),
    (Component.CAMERA, Fault.SLOW): Effect(
        summary="fewer frames than asked for", begin=_slow_camera, parameters=(_SLOW,)
    ),
    (Component.ESTOP, Fault.UNPLUG): Effect(
        summary="the cable is out", begin=lambda target: _pull(_estop_plug(target))
    ),
    (Component.ESTOP, Fault.WRONG): Effect(
        summary="it tells that it is pressed though nobody presses it", begin=_press
    ),
    **line_rows(Component.MICROPHONE, _microphone_line, _microphone_plug),
    # A speaker says nothing to its host, so nothing of that can be stuck, damaged or late.
    (Component.SPEAKER, Fault.OFF): Effect(
        summary="deaf; the sound is lost",
        begin=lambda target: _tamper(_speaker_line(target), Silence()),
    ),
    (Component.SPEAKER, Fault.UNPLUG): Effect(
        summary="the cable is out", begin=lambda target: _pull(_speaker_plug(target))
    ),
}
