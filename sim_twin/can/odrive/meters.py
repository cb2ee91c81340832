"""Measure what an ODrive tells of its motor: estimates, currents, torques, supply, heat."""

import math
from collections.abc import Callable, Mapping
from typing import Final

from drivers.odrive.codec import OdriveCommand
from sim_twin.can.odrive.controller import ODriveController
from sim_twin.can.power_stage import PowerStage, ShaftEncoder


class ODriveMeters:
    """Read encoder, controller and power stage; what the encoder's freezing holds is held here."""

    def __init__(
        self, stage: PowerStage, encoder: ShaftEncoder, controller: ODriveController
    ) -> None:
        self._stage = stage
        self._encoder = encoder
        self._controller = controller
        self.forget()

    def forget(self) -> None:
        """Begin anew, as after a restart."""
        self._offset_rev = 0.0
        self._torque_nm = 0.0

    def note_torque(self, torque_nm: float) -> None:
        """Take the motor's present torque."""
        if not self._encoder.frozen:
            self._torque_nm = torque_nm

    def call_position(self, position_rev: float) -> None:
        """Let the present position have this number."""
        self._offset_rev += position_rev - self.position_rev

    @property
    def position_rev(self) -> float:
        """Return the estimate of the position."""
        return self._encoder.travelled / self._encoder.counts_per_rev + self._offset_rev

    @property
    def velocity_rev_s(self) -> float:
        """Return the estimate of the velocity."""
        return self._encoder.counts_s / self._encoder.counts_per_rev

    def estimates(self) -> tuple[float, ...]:
        """Return position and velocity."""
        return self.position_rev, self.velocity_rev_s

    def currents(self) -> tuple[float, ...]:
        """Return the current wanted and the current measured."""
        per_a = self._stage.spec.torque_nm_per_a
        return self._controller.target_nm / per_a, self._torque_nm / per_a

    def torques(self) -> tuple[float, ...]:
        """Return the torque wanted and the torque estimated."""
        return self._controller.target_nm, self._torque_nm

    def temperatures(self) -> tuple[float, ...]:
        """Return the transistors' temperature, which is the room's, and the motor's."""
        return self._stage.spec.ambient_c, self._stage.temperature_c

    def supply(self) -> tuple[float, ...]:
        """Return voltage and current of the DC bus."""
        return self._stage.bus_v, self._stage.bus_current_a

    def powers(self) -> tuple[float, ...]:
        """Return electrical and mechanical power."""
        mechanical_w = self._torque_nm * self.velocity_rev_s * math.tau
        return self._stage.bus_v * self._stage.bus_current_a, mechanical_w


METERS: Final[Mapping[OdriveCommand, Callable[[ODriveMeters], tuple[float, ...]]]] = {
    OdriveCommand.GET_ENCODER_ESTIMATES: ODriveMeters.estimates,
    OdriveCommand.GET_IQ: ODriveMeters.currents,
    OdriveCommand.GET_TEMPERATURE: ODriveMeters.temperatures,
    OdriveCommand.GET_BUS_VOLTAGE_CURRENT: ODriveMeters.supply,
    OdriveCommand.GET_TORQUES: ODriveMeters.torques,
    OdriveCommand.GET_POWERS: ODriveMeters.powers,
}
