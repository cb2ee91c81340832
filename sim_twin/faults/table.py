"""Join the rows of all components: the one table of (component, fault) -> effect."""

from collections.abc import Mapping
from typing import Final

from sim_twin.faults.battery_effects import BATTERY_ROWS
from sim_twin.faults.can_effects import CAN_ROWS
from sim_twin.faults.effect import Effect
from sim_twin.faults.home_effects import HOME_ROWS
from sim_twin.faults.line_effects import SENSOR_ROWS
from sim_twin.faults.servo_effects import SERVO_ROWS
from sim_twin.faults.vocabulary import Component, Fault

EFFECTS: Final[Mapping[tuple[Component, Fault], Effect]] = {
    **SERVO_ROWS,
    **CAN_ROWS,
    **SENSOR_ROWS,
    **BATTERY_ROWS,
    **HOME_ROWS,
}


def faults_of(component: Component) -> tuple[Fault, ...]:
    """Return what a component supports; what has any effect can also come and go."""
    own = tuple(fault for fault in Fault if (component, fault) in EFFECTS)
    return (*own, Fault.INTERMITTENT) if own else ()
