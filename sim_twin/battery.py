"""Be the robot's battery: it drains by the power that is drawn, and charges at the dock.

The pack is a charge behind a resistance: its voltage is the open-circuit curve's, less what the
current takes. Its gauge is a folder of files as the kernel has them (sysfs-class-power).
"""

import errno
import itertools
import math
import shutil
from collections.abc import Callable
from enum import Enum
from pathlib import Path
from typing import Final

import mujoco

from drivers.clock import NS_PER_S
from sim_twin.physics.compose import ROBOT_ROOT
from sim_twin.physics.engine import Engine
from vla_deploy.robots import RobotDescription
from vla_deploy.robots.battery_settings import BatterySettings, CellCurve

START_RATIO: Final = 0.8
BASE_LOAD_W: Final = 30.0
"""Computer, camera, lidar and the electronics of the servos (chosen, not measured)."""
CHARGER_W: Final = 150.0
CELL_OHM: Final = 0.004
"""Resistance of a cell with its connectors (chosen)."""
USUAL_CURVE: Final[CellCurve] = ((3.0, 0.0), (3.45, 0.1), (3.6, 0.25), (3.7, 0.5), (4.15, 1.0))
"""Of a Li-ion cell, where the robot file has none."""
DOCK: Final = "charging_dock"
"""The geom of the world that charges what stands before it, with its back to it."""
_DOCK_NEAR_M: Final = 0.6
"""So near the dock a station must be for the base to touch it there."""
_DOCK_REACH_M: Final = 0.12
_DOCK_TURN_RAD: Final = 0.3
_DEFAULT_SUPPLY: Final = "BAT0"
_PERIOD_NS: Final = NS_PER_S // 10
_FILES_NS: Final = NS_PER_S
_TAPER_RATIO: Final = 0.9
"""From here on the charger gives less and less, as one of constant voltage does."""
_FULL_RATIO: Final = 0.999
_S_PER_H: Final = 3600.0
_MICRO: Final = 1e6


class GaugeFault(Enum):
    """Name what is wrong with the gauge."""

    NONE = "none"
    GONE = "gone"
    STUCK = "stuck"
    GARBAGE = "garbage"


class TwinBattery:
    """Hold the charge of one pack; `drawn_w` and `is_docked` say what acts on it."""

    def __init__(
        self,
        settings: BatterySettings,
        drawn_w: Callable[[], float],
        is_docked: Callable[[], bool],
        feed: Callable[[float], None],
    ) -> None:
        """`feed` takes the voltage, where devices hang on the pack directly."""
        self.settings = settings
        self.charge_ratio = START_RATIO
        self.capacity_wh = settings.capacity_wh
        self.current_a = 0.0
        """Positive into the pack."""
        self.voltage_v = 0.0
        self.is_charging = False
        self.gauge_fault = GaugeFault.NONE
        self.due_ns = 0
        self._drawn_w, self._is_docked, self._feed = drawn_w, is_docked, feed
        self._stepped_ns: int | None = None
        self._files: PowerSupplyFiles | None = None
        self._files_due_ns = 0

    def serve(self, root: Path) -> None:
        """Write the gauge's files below a folder from now on."""
        self._files = PowerSupplyFiles(root, self.settings.supply or _DEFAULT_SUPPLY)
        self._files_due_ns = 0

    def withdraw(self) -> None:
        """Take the gauge's files away, at the twin's end."""
        if self._files is not None:
            self._files.remove()
            self._files = None

    def step(self, now_ns: int) -> None:
        """Charge or drain the pack by the power since the last step."""
        before_ns = now_ns if self._stepped_ns is None else self._stepped_ns
        self._stepped_ns = now_ns
        self.due_ns = now_ns + _PERIOD_NS
        charger_w = self._charger_w()
        power_w = charger_w - BASE_LOAD_W - self._drawn_w()
        self.is_charging = power_w > 0.0 and self.charge_ratio < _FULL_RATIO
        if charger_w and self.charge_ratio >= _FULL_RATIO:
            power_w = 0.0  # the charger carries the load, and the pack rests
        self._take(power_w, (now_ns - before_ns) / NS_PER_S)
        self._feed(self.voltage_v)
        if self._files is not None and now_ns >= self._files_due_ns:
            self._files_due_ns = now_ns + _FILES_NS
            self._files.write(self)

    @property
    def status(self) -> str:
        """Return the kernel's word for what the pack does."""
        if self.is_charging:
            return "Charging"
        return "Discharging" if self.current_a < 0.0 else "Full"

    def _charger_w(self) -> float:
        if not self._is_docked():
            return 0.0
        left = (1.0 - self.charge_ratio) / (1.0 - _TAPER_RATIO)
        # It carries the load as well.
        return BASE_LOAD_W + self._drawn_w() + CHARGER_W * min(1.0, max(left, 0.05))

    def _take(self, power_w: float, duration_s: float) -> None:
        gained_wh = power_w * duration_s / _S_PER_H
        self.charge_ratio = min(1.0, max(0.0, self.charge_ratio + gained_wh / self.capacity_wh))
        cells = self.settings.cells
        open_v, ohm = cells * self._cell_v(), cells * CELL_OHM
        # Of the two currents that make this power, the smaller one flows.
        rest = math.sqrt(max(open_v * open_v + 4.0 * ohm * power_w, 0.0))
        self.current_a = (rest - open_v) / (2.0 * ohm)
        self.voltage_v = open_v + ohm * self.current_a

    def _cell_v(self) -> float:
        curve = self.settings.cell_curve or USUAL_CURVE
        for (low_v, low), (high_v, high) in itertools.pairwise(curve):
            if self.charge_ratio <= high:
                return low_v + (high_v - low_v) * (self.charge_ratio - low) / (high - low)
        return curve[-1][0]


class PowerSupplyFiles:
    """Show a pack as the kernel shows a gauge."""

    def __init__(self, root: Path, name: str) -> None:
        self._root = root / "sys"
        self.folder = self._root / "class/power_supply" / name

    def write(self, pack: TwinBattery) -> None:
        """Write what the gauge measures; its percentage is whole, as the kernel's is."""
        match pack.gauge_fault:
            case GaugeFault.NONE:
                self._write(pack)
            case GaugeFault.GONE:
                shutil.rmtree(self.folder, ignore_errors=True)
            case GaugeFault.GARBAGE:
                for name in ("capacity", "energy_now", "voltage_now", "current_now", "status"):
                    self._put(name, "?")
            case GaugeFault.STUCK:
                return

    def remove(self) -> None:
        """Take the whole tree away."""
        shutil.rmtree(self._root, ignore_errors=True)

    def _write(self, pack: TwinBattery) -> None:
        self._put("type", "Battery")
        self._put("present", "1")
        self._put("status", pack.status)
        self._put("capacity", str(round(100 * pack.charge_ratio)))
        self._put("voltage_now", str(round(pack.voltage_v * _MICRO)))
        self._put("current_now", str(round(pack.current_a * _MICRO)))
        self._put("energy_full", str(round(pack.capacity_wh * _MICRO)))
        self._put("energy_now", str(round(pack.capacity_wh * pack.charge_ratio * _MICRO)))

    def _put(self, name: str, text: str) -> None:
        """Replace a file at once: a reader sees the old text or the new one.

        Without room on the disk the old one stays: a kernel's gauge needs none, and no twin ends.
        """
        self.folder.mkdir(parents=True, exist_ok=True)
        written = self.folder / f".{name}"
        try:
            written.write_text(f"{text}\n", encoding="ascii")
        except OSError as error:
            if error.errno not in (errno.ENOSPC, errno.EDQUOT):
                raise
            return
        written.replace(self.folder / name)


def dock_contact(engine: Engine, robot: RobotDescription) -> Callable[[], bool]:
    """Return what says whether the base stands at the world's dock, its contacts on it.

    That is the pose of the robot file's station, where the world has a dock.
    """
    station = robot.battery.station if robot.battery is not None else ""
    place = robot.places.get(station)
    dock = mujoco.mj_name2id(engine.model, mujoco.mjtObj.mjOBJ_GEOM, DOCK)
    if place is None or dock < 0:
        return lambda: False
    pose, root = place.pose, engine.model.body(ROBOT_ROOT).id
    if math.dist((pose.x_m, pose.y_m), engine.data.geom_xpos[dock][:2]) > _DOCK_NEAR_M:
        return lambda: False

    def is_docked() -> bool:
        position, matrix = engine.data.xpos[root], engine.data.xmat[root]
        off_m = math.dist((pose.x_m, pose.y_m), position[:2])
        yaw_rad = math.atan2(matrix[3], matrix[0])
        turned_rad = abs(math.remainder(yaw_rad - pose.yaw_rad, 2 * math.pi))
        return off_m < _DOCK_REACH_M and turned_rad < _DOCK_TURN_RAD

    return is_docked
