"""Name the scenes of each suite, play them with the campaigns' own code, and score them."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Final

from drivers.clock import NS_PER_S, MonotonicClock
from sim_twin.campaigns import demos, missions, navigation
from sim_twin.campaigns.evidence import SceneEvidence, SceneWatch, Watch
from sim_twin.campaigns.report import CampaignCase, crash_is_failure
from sim_twin.campaigns.suites import grasping, safety, voice
from sim_twin.campaigns.suites.report import ScoredCase

ALL: Final = "all"
_CONTACTS: Final = ("touches", "pushes")
"""Figures that count contacts: of drives, and of demos."""
Figures = Mapping[str, Any]


@dataclass(frozen=True, slots=True, kw_only=True)
class SuiteScene:
    """Name one case: a scene of a suite, with a seed."""

    suite: str
    scene: str
    seed: int

    @property
    def name(self) -> str:
        """Return the case in words."""
        return f"{self.suite}/{self.scene}/{self.seed}"


@dataclass(frozen=True, slots=True, kw_only=True)
class SceneSuite:
    """Hold a suite: its scenes, who plays them, and which figure is which metric."""

    scenes: tuple[str, ...]
    play: Callable[[str, int, Watch], CampaignCase]
    metrics: Mapping[str, Callable[[Figures], float | None]]


def _figure(*names: str) -> Callable[[Figures], float | None]:
    """Return a way to get the first of these figures that there is."""

    def first(figures: Figures) -> float | None:
        return next((figures[name] for name in names if figures.get(name) is not None), None)

    return first


def _placement_mm(figures: Figures) -> float | None:
    error_m = figures.get("placement_error_m")
    return None if error_m is None else 1000.0 * error_m


def _time_saved(figures: Figures) -> float | None:
    return 1.0 - figures["share"] if "share" in figures else None


def _drive(scene: str, seed: int, watch: Watch) -> CampaignCase:
    return navigation.play(f"{scene}/{seed}", watch)


def _manipulate(scene: str, seed: int, watch: Watch) -> CampaignCase:
    if scene == grasping.SCENE:
        return grasping.play(scene, seed, watch)
    return demos.play(seed, scene)


def _mission(scene: str, seed: int, watch: Watch) -> CampaignCase:
    name = scene if "/" in scene else f"{scene}/{seed}"
    return missions.play(name, seed, watch)


SUITES: Final[Mapping[str, SceneSuite]] = {
    "voice": SceneSuite(
        scenes=tuple(voice.SCENES),
        play=voice.play,
        metrics={"accuracy": _figure("understood"), "response_s": _figure("response_s")},
    ),
    "navigation": SceneSuite(
        scenes=("drives", "around", "passing", "following"),
        play=_drive,
        metrics={
            "accuracy": _figure("share_beside"),
            "path_efficiency": _figure("path_efficiency"),
        },
    ),
    "manipulation": SceneSuite(
        scenes=("butler", "so101", grasping.SCENE),
        play=_manipulate,
        metrics={"placement_mm": _placement_mm},
    ),
    "integration": SceneSuite(
        scenes=("documents", "side_by_side", "paused/pick_up"),
        play=_mission,
        metrics={
            "accuracy": _figure("success_rate"),
            "placement_mm": _placement_mm,
            "coordination": _time_saved,
        },
    ),
    "safety": SceneSuite(
        scenes=safety.SCENES,
        play=safety.play,
        metrics={
            "accuracy": _figure("named_right"),
            "path_efficiency": _figure("path_efficiency"),
            "response_s": _figure("rest_s", "cause_s"),
        },
    ),
}


def scenes_of(suite: str, seeds: range) -> Iterator[SuiteScene]:
    """Yield the cases of a suite, or of all of them."""
    for name, one in SUITES.items():
        if suite in (name, ALL):
            for scene in one.scenes:
                for seed in seeds:
                    yield SuiteScene(suite=name, scene=scene, seed=seed)


def play(case: SuiteScene) -> ScoredCase:
    """Play a case and score it; of what passed no pictures are kept."""
    watch, clock = SceneWatch(), MonotonicClock()
    begun_ns = clock.now_ns()
    played = _played(case, watch)
    return scored(case, played, watch.evidence, (clock.now_ns() - begun_ns) / NS_PER_S)


@crash_is_failure
def _played(case: SuiteScene, watch: SceneWatch) -> CampaignCase:
    return SUITES[case.suite].play(case.scene, case.seed, watch)


def scored(
    case: SuiteScene, played: CampaignCase, seen: tuple[SceneEvidence, ...], seconds: float
) -> ScoredCase:
    """Return a played case with its metrics."""
    found = {name: get(played.figures) for name, get in SUITES[case.suite].metrics.items()}
    metrics = {name: float(value) for name, value in found.items() if value is not None}
    if not played.skipped:
        metrics["success_rate"] = float(not played.failures)
    pushes = [one.pushes for one in seen] + [played.figures.get(name) for name in _CONTACTS]
    counted = [one for one in pushes if one is not None]
    if counted:
        metrics["collisions"] = float(sum(counted))
    return ScoredCase(
        name=case.name,
        failures=played.failures,
        skipped=played.skipped,
        figures=played.figures,
        seconds=seconds,
        metrics=metrics,
        evidence=seen if played.failures else tuple(one.without_pictures() for one in seen),
    )
