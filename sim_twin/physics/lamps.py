"""Let the lamps of a world shine: a material named `lit_<device>` glows while that is on."""

from collections.abc import Collection
from typing import Final

import mujoco

_PREFIX: Final = "lit_"
_OFF_EMISSION: Final = 0.4
_ON_EMISSION: Final = 1.0


def show_lamps(model: mujoco.MjModel, switched_on: Collection[str]) -> None:
    """Give each lamp's material the look of a lamp that is on, or off."""
    for number in range(model.nmat):
        name = model.mat(number).name
        if name.startswith(_PREFIX):
            is_on = name.removeprefix(_PREFIX) in switched_on
            model.mat_emission[number] = _ON_EMISSION if is_on else _OFF_EMISSION
