"""Say commands aloud in the twin's room, in lock-step, and see what is understood and done."""

import math
import tempfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from drivers.audio.espeak import EspeakEngine
from drivers.clock import NS_PER_S
from drivers.errors import VoiceError
from sim_twin.campaigns.evidence import Watch, unwatched
from sim_twin.campaigns.report import CampaignCase
from sim_twin.harness.lockstep_stack import LockstepStack, armed_lockstep
from sim_twin.sound.hearing import Spoken
from sim_twin.sound.talker import Talker
from vla_deploy.ipc import topics

Truth = Mapping[str, Any]
TALKERS: Final[tuple[tuple[str, float | None], ...]] = (
    ("en-gb-x-rp+m3", None),
    ("en-us+f4", 20.0),
    ("en-gb+f2", None),
    ("en-us+m7", 20.0),
)
"""Voices of eSpeak NG, with the noise that they speak over (dB below them), in turn by the seed."""
_QUIET_S: Final = 1.0
_PLAN_S: Final = 5.0
_DONE_S: Final = 60.0


@dataclass(frozen=True, slots=True, kw_only=True)
class VoiceScene:
    """Hold what is said, the plan that must come of it, and what physics must see then."""

    words: str
    skill: str
    parameters: Mapping[str, object]
    is_done: Callable[[Truth, Truth], bool] = lambda _before, _after: True


def _turned(before: Truth, after: Truth) -> bool:
    turned_rad = after["robot"]["yaw_rad"] - before["robot"]["yaw_rad"]
    return abs(math.remainder(turned_rad - math.radians(20.0), math.tau)) < 0.05


def _moved(before: Truth, after: Truth) -> bool:
    ends = ([truth["robot"][axis] for axis in ("x_m", "y_m")] for truth in (before, after))
    return abs(math.dist(*ends) - 0.5) < 0.05


def _looks_left(before: Truth, after: Truth) -> bool:
    pans_rad = (truth["joints"]["head_pan"]["position"] for truth in (after, before))
    return float(next(pans_rad)) - float(next(pans_rad)) > 0.3


def _drove(before: Truth, after: Truth) -> bool:
    ends = ([truth["robot"][axis] for axis in ("x_m", "y_m")] for truth in (before, after))
    return math.dist(*ends) > 1.0


SCENES: Final[Mapping[str, VoiceScene]] = {
    "turn": VoiceScene(
        words="turn left twenty degrees",
        skill="turn",
        parameters={"angle_rad": math.radians(20.0)},
        is_done=_turned,
    ),
    "move": VoiceScene(
        words="move forward half a meter",
        skill="move",
        parameters={"distance_m": 0.5},
        is_done=_moved,
    ),
    "look": VoiceScene(
        words="look to the left",
        skill="look_at",
        parameters={"direction": "left"},
        is_done=_looks_left,
    ),
    "hand": VoiceScene(
        words="open your left hand", skill="open_gripper", parameters={"arm": "left"}
    ),
    "speak": VoiceScene(words="say hello", skill="speak", parameters={"text": "Hello."}),
    "go": VoiceScene(
        words="go to the kitchen",
        skill="navigate_to",
        parameters={"place": "kitchen"},
        is_done=_drove,
    ),
}


@dataclass(slots=True)
class _Answer:
    """Collect what the robot made of the words."""

    spoken: Spoken
    plan: list[dict[str, Any]] | None = None
    began_s: float | None = None
    end: Mapping[str, Any] | None = None
    heard: list[str] = field(default_factory=list)


def play(scene: str, seed: int, watch: Watch = unwatched) -> CampaignCase:
    """Play a scene with the seed's talker; skipped where no voice can be made."""
    name = f"{scene}/{seed}"
    with (
        tempfile.TemporaryDirectory(prefix="vla-") as folder,
        armed_lockstep(Path(folder), seed=seed, speech=True) as stack,
    ):
        watch(stack)
        try:
            return _spoken(name, SCENES[scene], *TALKERS[seed % len(TALKERS)], stack)
        except VoiceError as error:
            return CampaignCase(name=name, skipped=str(error))


def _spoken(
    name: str, scene: VoiceScene, voice: str, snr_db: float | None, stack: LockstepStack
) -> CampaignCase:
    stack.lockstep.run_for(_QUIET_S)
    before = stack.lockstep.truth()
    events = stack.space.ring_reader(topics.TASK_EVENT, from_start=False)
    heard = stack.space.ring_reader(topics.HEARD, from_start=False)
    talker = Talker(engine=EspeakEngine(voice=voice))
    answer = _Answer(stack.speak(scene.words, talker, snr_db))

    def look() -> None:
        now_s = (stack.lockstep.twin.now_ns - answer.spoken.ends_ns) / NS_PER_S
        answer.heard += [str(event.payload.get("text", "")) for event in heard.drain()]
        for event in events.drain():
            match event.payload["event"]:
                case "plan":
                    answer.plan = [{**one} for one in event.payload["plan"]["actions"]]
                case "action" if answer.began_s is None:
                    answer.began_s = now_s
                case "finished" | "rejected":
                    answer.end = event.payload

    def has_plan() -> bool:
        look()
        return answer.plan is not None or answer.end is not None

    def has_ended() -> bool:
        look()
        return answer.end is not None

    words_s = (answer.spoken.ends_ns - stack.lockstep.twin.now_ns) / NS_PER_S
    if stack.lockstep.run_until(has_plan, words_s + _PLAN_S) and answer.plan is not None:
        stack.lockstep.run_until(has_ended, _DONE_S)
    return _judged(name, scene, answer, before, stack.lockstep.truth())


def _judged(
    name: str, scene: VoiceScene, answer: _Answer, before: Truth, after: Truth
) -> CampaignCase:
    understood = answer.plan is not None and _is_right(scene, answer.plan)
    failures = []
    if not understood:
        planned = [(one["skill"], one["parameters"]) for one in answer.plan or ()]
        failures.append(f'"{scene.words}" heard as {answer.heard}, planned {planned}')
    elif not (answer.end or {}).get("success"):
        failures.append(f"failed: {(answer.end or {}).get('error') or 'no end in time'}")
    elif not scene.is_done(before, after):
        failures.append("physics does not see it done")
    figures = {"understood": float(understood), "response_s": answer.began_s}
    return CampaignCase(name=name, failures=tuple(failures), figures=figures)


def _is_right(scene: VoiceScene, plan: list[dict[str, Any]]) -> bool:
    if [one["skill"] for one in plan] != [scene.skill]:
        return False
    given = plan[0]["parameters"]
    return all(_is_same(given.get(name), value) for name, value in scene.parameters.items())


def _is_same(given: object, wanted: object) -> bool:
    if isinstance(given, int | float) and isinstance(wanted, int | float):
        return math.isclose(given, wanted, abs_tol=0.01)
    return given == wanted
