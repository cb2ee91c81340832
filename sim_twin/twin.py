"""Join the physics to every emulated device: what a bus says moves a motor, and back."""

from pathlib import Path
from typing import Any, TypeVar

from drivers.imu import bno085_rvc
from drivers.lidar import ld19
from sim_twin.battery import TwinBattery, dock_contact
from sim_twin.can import CanWire, robot_drives
from sim_twin.device import WireDevice
from sim_twin.errors import TwinModelMismatch
from sim_twin.faults.injector import FaultInjector
from sim_twin.faults.line_tamper import LineTamper
from sim_twin.faults.plug import Plug
from sim_twin.faults.supply import Supply
from sim_twin.home.appliances import EmulatedHome
from sim_twin.physics.hazards import HazardWatch
from sim_twin.physics.lamps import show_lamps
from sim_twin.physics.load import load_engine
from sim_twin.physics.person import WorldPerson
from sim_twin.pictures.head_camera import HeadCamera, camera_line
from sim_twin.ports.streams import StreamedDevice, streamed_devices
from sim_twin.sensors.estop import EstopButtonDevice
from sim_twin.sensors.imu import ImuDevice
from sim_twin.sensors.lidar import LidarDevice
from sim_twin.sensors.sound import MicrophoneDevice, SpeakerDevice
from sim_twin.servos import Coupling, WireTiming
from sim_twin.servos.power_relay import LcusRelayDevice, PulsedRelayDevice, emulated_relay
from sim_twin.servos.robot_bank import robot_bank, supply_volts
from vla_deploy.robots import RobotDescription
from vla_deploy.robots.battery_settings import BatterySource

S = TypeVar("S", bound=StreamedDevice)
L = TypeVar("L", LidarDevice, ImuDevice)
_NO_CAN_BITRATE = 1_000_000
"""Of a wire that nothing is on."""


class Twin:
    """Be the robot's machine: physics, servos, drives, lidar and IMU, stepped as one.

    A host reaches a device through `lines`, as long as the `plugs` are in; `faults` may disturb
    both, and the devices behind them.
    """

    def __init__(
        self,
        robot: RobotDescription,
        world: str = "",
        seed: int = 0,
        servo_timing: WireTiming | None = None,
    ) -> None:
        """Build the robot in a world, "" for that of its file.

        Without `servo_timing` the servo bus takes no time.

        Raises:
            ModelMismatch: there is no such world, or robot and world do not fit together.
        """
        self.robot = robot
        self.engine = load_engine(robot, world, seed)
        self.person = WorldPerson(self.engine)
        shafts = self.engine.servos
        coupling = Coupling(rad_per_joint=shafts.rad_per_joint, zero_rad=shafts.zero_rad)
        self.servos = robot_bank(robot.servo_bus, servo_timing, coupling)
        parts = robot.parts
        self.drives = robot_drives(parts.can_bus) if parts.can_bus else ()
        self._drive_laws = [drive.advance for drive in self.drives]
        bitrate = parts.can_bus.bitrate if parts.can_bus else _NO_CAN_BITRATE
        self.can_wire = CanWire(self.drives, bitrate=bitrate)
        self.serial_devices: dict[str, WireDevice] = {robot.servo_bus.device: self.servos}
        self._looking: list[LidarDevice | ImuDevice] = []
        frame_bytes: dict[str, int] = {}
        if parts.lidar is not None:
            lidar = LidarDevice(self.engine.lidar.cast, seed=seed)
            self._looking.append(lidar)
            self.serial_devices[parts.lidar.device] = lidar
            frame_bytes[parts.lidar.device] = ld19.PACKET_BYTES
        if parts.imu is not None:
            imu = ImuDevice(self.engine.imu.read, seed=seed)
            self._looking.append(imu)
            self.serial_devices[parts.imu.device] = imu
            frame_bytes[parts.imu.device] = bno085_rvc.FRAME_BYTES
        self.relay = None if robot.power_relay is None else emulated_relay(robot.power_relay)
        if robot.power_relay is not None and isinstance(self.relay, LcusRelayDevice):
            self.serial_devices[robot.power_relay.device] = self.relay
        self.lines = {
            name: LineTamper(device, self._now_ns, frame_bytes.get(name))
            for name, device in self.serial_devices.items()
        }
        self.streamed_devices = streamed_devices(robot, seed)
        if robot.power_relay is not None and isinstance(self.relay, PulsedRelayDevice):
            self.streamed_devices[robot.power_relay.device] = self.relay
        self.stream_lines = {
            name: LineTamper(device, self._now_ns) for name, device in self.streamed_devices.items()
        }
        names = [*self.lines, *self.stream_lines]
        if parts.camera is not None:
            names.append(parts.camera.device)
        self.plugs = {name: Plug() for name in names}
        self.servo_supplies = {
            name: Supply(volts) for name, volts in supply_volts(robot.servo_bus).items()
        }
        self.battery = self._battery(robot)
        self.faults = FaultInjector(self)
        self._hazards: HazardWatch | None = None
        self._camera: HeadCamera | None = None
        self._home: EmulatedHome | None = None
        self._shining: tuple[str, ...] | None = None
        self._camera_line: LineTamper | None = None
        self._seed = seed

    @property
    def now_ns(self) -> int:
        """Return simulated time in nanoseconds."""
        return self.engine.now_ns

    @property
    def lidar(self) -> LidarDevice:
        """Return the lidar.

        Raises:
            ModelMismatch: the robot file declares none.
        """
        return self._sensor(LidarDevice, "a lidar")

    @property
    def imu(self) -> ImuDevice:
        """Return the IMU.

        Raises:
            ModelMismatch: the robot file declares none.
        """
        return self._sensor(ImuDevice, "an IMU")

    def _sensor(self, kind: type[L], what: str) -> L:
        for sensor in self._looking:
            if isinstance(sensor, kind):
                return sensor
        raise TwinModelMismatch(f"the twin of {self.robot.name} needs {what} in the robot file")

    @property
    def estop_button(self) -> EstopButtonDevice:
        """Return the emergency-stop button, to be pressed and released.

        Raises:
            ModelMismatch: the robot file declares none that the twin has.
        """
        return self._streamed(EstopButtonDevice, "an e-stop button of model HID")

    @property
    def microphone(self) -> MicrophoneDevice:
        """Return the microphone, to which sound can be played.

        Raises:
            ModelMismatch: the robot file declares none.
        """
        return self._streamed(MicrophoneDevice, "a microphone")

    @property
    def speaker(self) -> SpeakerDevice:
        """Return the speaker, which keeps what the robot says.

        Raises:
            ModelMismatch: the robot file declares none.
        """
        return self._streamed(SpeakerDevice, "a speaker")

    @property
    def camera(self) -> HeadCamera:
        """Return the head camera, which renders in this process from its first use on."""
        if self._camera is None:
            engine = self.engine
            self._camera = HeadCamera(engine.model, engine.data, self.robot.camera, self._seed)
        return self._camera

    @property
    def camera_line(self) -> LineTamper:
        """Return the head camera's line."""
        if self._camera_line is None:
            self._camera_line = camera_line(self.camera, self.robot.camera, self._now_ns)
        return self._camera_line

    @property
    def hazards(self) -> HazardWatch:
        """Return who looks for hazards, in every step from the first use on."""
        if self._hazards is None:
            self._hazards = HazardWatch(self.engine.model, self.engine.data, self.robot)
        return self._hazards

    @property
    def home(self) -> EmulatedHome:
        """Return the home beside the robot, with its broker and what is switched there.

        Raises:
            TwinModelMismatch: it has not begun, or the robot file has no device on MQTT.
        """
        if self._home is None:
            needed = "[[devices]] on MQTT in the robot file, and begin_home"
            raise TwinModelMismatch(f"the twin of {self.robot.name} needs {needed}")
        return self._home

    @property
    def switched_on(self) -> tuple[str, ...]:
        """Return the names of the home's devices that are on."""
        return () if self._home is None else tuple(sorted(self._home.switched_on))

    def begin_home(self, path: Path) -> None:
        """Serve the home's broker on a Unix socket, where the robot file has devices on it.

        Raises:
            OSError: the path cannot be bound.
        """
        if any(device.mqtt is not None for device in self.robot.devices.values()):
            self._home = EmulatedHome(self.robot, path)

    def leave_home(self) -> None:
        """End the home's broker."""
        home, self._home = self._home, None
        if home is not None:
            home.close()

    def truth(self) -> dict[str, Any]:
        """Return what the physics knows, and what is on in the home."""
        truth = {**self.engine.referee.truth(), "switched_on": list(self.switched_on)}
        return truth if self.relay is None else {**truth, "servo_supply": self.has_servo_supply}

    @property
    def has_servo_supply(self) -> bool:
        """Return whether the relay in the servos' supply is closed, if there is one."""
        return self.relay is None or self.relay.is_closed(self.now_ns)

    def announce(self, stream: str) -> None:
        """Let a streamed device begin anew for its next host.

        Raises:
            KeyError: there is no such stream.
        """
        device = self.streamed_devices[stream]
        device.step(self.now_ns)
        device.announce()

    def slip_encoder(self, servo_id: int, offset_rad: float) -> None:
        """Let a servo measure its shaft further off than it does, as after a blow."""
        ids = [servo.id for servo in self.robot.servo_bus.all_servos]
        self.engine.servos.slip(ids.index(servo_id), offset_rad)
        self.servos.couple_anew()

    def step(self) -> None:
        """Let the firmware act, the physics follow and the sensors look.

        A device that only answers learns the time when it is talked to.
        """
        self.faults.step()
        self._drive_motors()
        self.person.step()
        self.engine.step()
        now_ns = self.engine.now_ns
        for sensor in self._looking:
            if now_ns >= sensor.due_ns:
                sensor.step(now_ns)
        self.can_wire.poll(now_ns)
        if self.battery is not None and now_ns >= self.battery.due_ns:
            self.battery.step(now_ns)
        if self._camera is not None:
            self._show_lamps()
            self._camera.device.step(now_ns)
        if self._hazards is not None:
            self._hazards.step(now_ns)

    def close(self) -> None:
        """Release OpenGL where the camera was used, end the home's broker, withdraw the gauge."""
        self.leave_home()
        if self.battery is not None:
            self.battery.withdraw()
        if self._camera is not None:
            self._camera.close()

    def _show_lamps(self) -> None:
        if (switched_on := self.switched_on) != self._shining:
            show_lamps(self.engine.model, switched_on)
            self._shining = switched_on

    def _battery(self, robot: RobotDescription) -> TwinBattery | None:
        """Return the pack of the robot file; servos hang on it where they measure it.

        Of several supplies it is the first, and the others stand behind regulators.
        """
        if robot.battery is None:
            return None
        feeds = robot.battery.source is BatterySource.SERVOS
        return TwinBattery(
            robot.battery,
            drawn_w=self._drawn_w,
            is_docked=dock_contact(self.engine, robot),
            feed=next(iter(self.servo_supplies.values())).feed if feeds else _keep_regulated,
        )

    def _drawn_w(self) -> float:
        return self.servos.supply_w + sum(drive.supply_w for drive in self.drives)

    def _streamed(self, kind: type[S], what: str) -> S:
        for device in self.streamed_devices.values():
            if isinstance(device, kind):
                device.step(self.now_ns)
                return device
        raise TwinModelMismatch(f"the twin of {self.robot.name} needs {what} in the robot file")

    def _now_ns(self) -> int:
        return self.engine.now_ns

    def _drive_motors(self) -> None:
        engine, now_ns = self.engine, self.engine.now_ns
        shafts, is_fed = engine.servos, self.has_servo_supply
        duty = self.servos.advance(
            now_ns,
            shafts.joint_motion(),
            shafts.joint_effort(),
            tuple(supply.volts(now_ns) * is_fed for supply in self.servo_supplies.values()),
        )
        shafts.command(duty)
        engine.drives.command_each(now_ns, self._drive_laws)


def _keep_regulated(_volts: float) -> None:
    """Leave the servos' supply as it is: a regulator stands between it and the pack."""
