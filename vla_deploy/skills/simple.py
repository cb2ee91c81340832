"""Speak, wait, stop: skills that need no body, or only its stillness."""

from collections.abc import Mapping
from typing import Any

from vla_deploy.skills.context import Skill, SkillContext
from vla_deploy.skills.drive import stand_still
from vla_deploy.skills.motion import pause


def speak(context: SkillContext, parameters: Mapping[str, Any]) -> Skill:
    """Say a sentence; the text is always shown."""
    context.say(str(parameters["text"]))
    yield


def wait(context: SkillContext, parameters: Mapping[str, Any]) -> Skill:
    """Do nothing for a while."""
    yield from pause(context, float(parameters["duration_s"]))


def stop(context: SkillContext, parameters: Mapping[str, Any]) -> Skill:
    """Cancel every motion and bring the base to rest."""
    del parameters
    context.link.halt()
    yield from stand_still(context)
