"""Check that a person can stop the robot by voice."""

from collections.abc import Iterator
from typing import Final

from vla_deploy.doctor.context import DoctorContext
from vla_deploy.doctor.finding import DoctorFinding, missing, ok, warn
from vla_deploy.inference.errors import InferenceError
from vla_deploy.inference.roles import ModelShelf
from vla_deploy.runtime.one_line import one_line
from vla_deploy.runtime.state_dir import engines_dir_of
from vla_deploy.speech.stop_words.listener import OFF
from vla_deploy.speech.stop_words.spotter import open_spotter
from vla_deploy.supervisor.runs.runtime import default_base

NAME: Final = "spoken stop"


def spoken_stop(context: DoctorContext) -> Iterator[DoctorFinding]:
    """Check that stop words are switched on and that their model runs."""
    profile, robot = context.profile, context.robot
    if profile is None:
        yield missing(NAME, "no profile to look at", "vla-deploy doctor --profile desktop")
    elif robot is not None and robot.microphone is None:
        yield missing(NAME, f"{robot.name} has no microphone: nobody can stop it by voice")
    elif profile.speech.stop_words == OFF:
        remedy = 'set speech.stop_words = "normal" in the profile'
        yield warn(NAME, "switched off: nobody can stop the robot by voice", remedy)
    else:
        engines = engines_dir_of(default_base())
        shelf = ModelShelf(store=context.models, engines=engines, clock=context.clock)
        try:
            spotter = open_spotter(shelf, profile)
        except InferenceError as error:
            yield warn(NAME, one_line(error), "vla-deploy models list")
            return
        chosen = profile.speech.stop_words
        words = ", ".join(spotter.words)
        yield ok(NAME, f"{words}; sensitivity {chosen}, from {spotter.thresholds[chosen]:g} on")
