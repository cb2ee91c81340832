"""Speak, wait, stop: skills that need no body, or only its stillness."""

from collections.abc import Mapping
from typing import Any, Final

from vla_deploy.ipc import Announced
from vla_deploy.skills.context import Skill, SkillContext
from vla_deploy.skills.movements.drive import stand_still
from vla_deploy.skills.movements.motion import pause, wait_until

PATIENCE_S: Final = 8.0
S_PER_LETTER: Final = 0.12  # a slow voice; a usual one takes 0.07 s
LONGEST_S: Final = 50.0
FINISHED: Final = "finished"


def speak(context: SkillContext, parameters: Mapping[str, Any]) -> Skill:
    """Say a sentence; the text is always shown, and heard where there is a voice.

    A voice that is missing, interrupted or late is no failure of the plan: the result says so.
    """
    text = str(parameters["text"])
    context.say(text)
    silent = context.voice.why_silent()
    if silent:
        context.note(f"shown, not spoken: {silent}")
        yield
        return
    yield from _say_aloud(context, text)


def _say_aloud(context: SkillContext, text: str) -> Skill:
    say_id = context.voice.say(text)
    heard: list[Announced] = []

    def has_ended() -> bool:
        ended = context.voice.ended(say_id)
        heard.extend([] if ended is None else [ended])
        return bool(heard)

    longest_s = min(PATIENCE_S + len(text) * S_PER_LETTER, LONGEST_S)
    try:
        yield from wait_until(context, has_ended, longest_s)
    finally:
        if not heard:
            context.voice.take_back(say_id)
    if not heard:
        context.note(f"shown, not spoken to its end: the voice took longer than {longest_s:g} s")
    elif heard[0].event != FINISHED:
        context.note(f"shown, not spoken to its end: {heard[0].event}: {heard[0].reason}")


def wait(context: SkillContext, parameters: Mapping[str, Any]) -> Skill:
    """Do nothing for a while."""
    yield from pause(context, float(parameters["duration_s"]))


def stop(context: SkillContext, parameters: Mapping[str, Any]) -> Skill:
    """Cancel every motion and bring the base to rest."""
    del parameters
    context.link.halt()
    yield from stand_still(context)
