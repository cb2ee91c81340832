"""Declare every trouble of the pressure campaign, and all that may follow from it."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from sim_twin.campaigns.pressing.pressed_scene import COOL_C, PressedScene

_DAY_S: Final = 86_400


@dataclass(frozen=True, slots=True, kw_only=True)
class Trouble:
    """Declare one trouble and all that may follow from it.

    `press` is called again and again with the seconds since it began, `lift` once. `steps` are
    those of the ladder in their order, `metric` the budget's line that must tell of it, `states`
    those in which control may be, `replaced` the processes that may end. The limits are for the
    last step, and for full service once it is over.
    """

    name: str
    press: Callable[[PressedScene, float], None]
    lift: Callable[[PressedScene], None]
    steps: tuple[str, ...] = ()
    metric: str = ""
    states: tuple[str, ...] = ("armed",)
    replaced: tuple[str, ...] = ()
    steps_s: float = 30.0
    service_s: float = 60.0
    small_disk: bool = False
    shifted_clock: bool = False


def _ramp(scene: PressedScene, seconds: float) -> None:
    scene.heat(min(COOL_C + 5.0 * seconds, 92.0))


def _brown_out(scene: PressedScene, seconds: float) -> None:
    if seconds == 0.0:
        scene.brown_out()


def _fill(scene: PressedScene, seconds: float) -> None:
    if seconds == 0.0:
        scene.fill_disk()


def _jump(days: int) -> Callable[[PressedScene, float], None]:
    def press(scene: PressedScene, seconds: float) -> None:
        if seconds == 0.0:
            scene.shift_clock(days * _DAY_S)

    return press


_OWN_STEPS: Final = ("slow perception", "restart perception")
TROUBLES: Final = (
    Trouble(
        name="memory_hog",
        press=lambda scene, _: scene.wish(memory_mb=700),
        lift=lambda scene: scene.wish(),
        steps=_OWN_STEPS,
        metric="memory_mb",
        replaced=("perception",),
    ),
    Trouble(
        name="cpu_hog",
        press=lambda scene, _: scene.wish(busy_cores=64),
        lift=lambda scene: scene.wish(),
        steps=_OWN_STEPS,
        metric="cpu_ratio",
        replaced=("perception",),
    ),
    Trouble(
        name="disk_full",
        press=_fill,
        lift=lambda scene: scene.free_disk(),
        metric="disk_free_mb",
        small_disk=True,
    ),
    Trouble(
        name="thermal_ramp",
        press=_ramp,
        lift=lambda scene: scene.heat(COOL_C),
        steps=("slow perception", "suspend planner", "protective_stop"),
        metric="temperature_c",
        states=("armed", "protective_stop"),
        replaced=("planner",),
    ),
    Trouble(
        name="brown_out",
        press=_brown_out,
        lift=lambda _: None,
        steps=("protective_stop",),
        states=("armed", "protective_stop"),
    ),
    Trouble(
        name="clock_forward",
        press=_jump(400),
        lift=lambda scene: scene.shift_clock(0),
        shifted_clock=True,
    ),
    Trouble(
        name="clock_back",
        press=_jump(-400),
        lift=lambda scene: scene.shift_clock(0),
        shifted_clock=True,
    ),
)
