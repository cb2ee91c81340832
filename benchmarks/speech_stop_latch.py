"""Let a person in the twin's room stop a moving arm: from the word to latch and standstill."""

import tempfile
from pathlib import Path
from typing import Any, Final

from drivers.clock import NS_PER_S
from platforms import load_profile
from sim_twin.harness.stack import LockstepControl
from sim_twin.sound.streams import streamed_microphone
from sim_twin.sound.talker import Talker
from vla_deploy.ipc import topics
from vla_deploy.speech.node import SpeechNode
from vla_deploy.speech.stop_words.listener import build_stop_words
from vla_deploy.speech.voice.tts import EspeakEngine

_CASES: Final = (
    ("stop", "en-us", None),
    ("robot, halt!", "en-gb+f3", 10.0),
    ("freeze", "en+m3", 10.0),
)
_MOVING_RAD_S: Final = 0.1
_STILL_RAD_S: Final = 0.02
_TARGETS: Final = {"left_shoulder_pitch": 1.2, "right_shoulder_pitch": 1.2}
_PATIENCE_S: Final = 3.0


def latch(cases: int = len(_CASES)) -> dict[str, Any]:
    """Return the longest times of some cases, None where a word was not heard.

    Raises:
        VoiceError: eSpeak NG is not installed.
    """
    latched_s: list[float | None] = []
    still_s: list[float | None] = []
    for text, voice, snr_db in _CASES[:cases]:
        with tempfile.TemporaryDirectory() as folder:
            rig = LockstepControl(Path(folder))
            try:
                latched, still = _stop(rig, text, voice, snr_db)
            finally:
                rig.close()
        latched_s.append(latched)
        still_s.append(still)
    return {"stop_latch_s": _longest(latched_s), "stop_standstill_s": _longest(still_s)}


def _stop(
    rig: LockstepControl, text: str, voice: str, snr_db: float | None
) -> tuple[float | None, float | None]:
    clock, context = rig.lockstep, rig.lockstep.context
    profile = load_profile("desktop")
    microphone = streamed_microphone(rig.robot, clock.devices, clock.clock)
    listener = build_stop_words(context, profile)
    clock.add(SpeechNode(context, rig.robot, profile, microphone, stop_words=listener))
    rig.arm()
    rig.space.ring_writer(topics.MOTION_COMMAND).publish(
        {"kind": "goal", "motion_id": 1, "targets": _TARGETS, "speed_ratio": 0.1}
    )
    if not clock.run_until(lambda: _fastest(rig) > _MOVING_RAD_S, _PATIENCE_S):
        return None, None
    ends_ns = rig.speak(text, Talker(engine=EspeakEngine(voice=voice)), snr_db).ends_ns
    if not clock.run_until(lambda: rig.status()["estop_latched"], _PATIENCE_S):
        return None, None
    latched_s = clock.now_s - ends_ns / NS_PER_S
    if not clock.run_until(lambda: _fastest(rig) < _STILL_RAD_S, _PATIENCE_S):
        return latched_s, None
    return latched_s, clock.now_s - ends_ns / NS_PER_S


def _fastest(rig: LockstepControl) -> float:
    joints = rig.lockstep.truth()["joints"]
    return max(abs(float(joints[name]["velocity"])) for name in _TARGETS)


def _longest(times_s: list[float | None]) -> float | None:
    told = [one for one in times_s if one is not None]
    return max(told) if len(told) == len(times_s) and told else None
