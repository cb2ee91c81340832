"""A spoken stop that nobody would hear is told before it is needed."""

import dataclasses
import shutil

from platforms import load_profile
from vla_deploy.doctor import DoctorContext, FindingLevel
from vla_deploy.doctor.speech import spoken_stop
from vla_deploy.inference.store import EMBEDDED, ModelStore


def with_stop_words(context: DoctorContext, sensitivity: str) -> DoctorContext:
    profile = load_profile("desktop")
    speech = dataclasses.replace(profile.speech, stop_words=sensitivity)
    profile = dataclasses.replace(profile, speech=speech)
    store = ModelStore(context.models.user, system=context.models.user.parent / "system")
    return dataclasses.replace(context, profile=profile, models=store)


def test_the_shipped_model_is_opened_and_its_words_are_told(computer) -> None:
    (finding,) = spoken_stop(with_stop_words(computer.context(robot="butler"), "normal"))
    assert finding.level is FindingLevel.OK
    assert finding.measured.startswith("stop, halt, freeze; sensitivity normal, from 0.")


def test_a_model_that_root_has_added_is_found(computer) -> None:
    context = with_stop_words(computer.context(robot="butler"), "normal")
    assert context.profile is not None
    folder = computer.root / "system" / "louder"
    shutil.copytree(EMBEDDED / "stop_words", folder)
    manifest = folder / "model.toml"
    manifest.write_text(manifest.read_text().replace("stop_words", "louder", 1))
    choice = dataclasses.replace(context.profile.models["key_words"], tiers=("louder",))
    profile = dataclasses.replace(context.profile, models={"key_words": choice})
    (finding,) = spoken_stop(dataclasses.replace(context, profile=profile))
    assert finding.level is FindingLevel.OK


def test_switched_off_is_a_warning_that_says_how_to_switch_it_on(computer) -> None:
    (finding,) = spoken_stop(with_stop_words(computer.context(robot="butler"), "off"))
    assert finding.level is FindingLevel.WARN
    assert "nobody can stop the robot by voice" in finding.measured
    assert "speech.stop_words" in finding.remedy


def test_without_a_model_it_is_a_warning(computer) -> None:
    context = with_stop_words(computer.context(robot="butler"), "normal")
    assert context.profile is not None
    bare = dataclasses.replace(context, profile=dataclasses.replace(context.profile, models={}))
    (finding,) = spoken_stop(bare)
    assert finding.level is FindingLevel.WARN
    assert "[models.key_words]" in finding.measured


def test_a_robot_without_a_microphone_says_so(computer) -> None:
    context = with_stop_words(computer.context(robot="butler"), "normal")
    assert context.robot is not None
    deaf = dataclasses.replace(context, robot=dataclasses.replace(context.robot, microphone=None))
    (finding,) = spoken_stop(deaf)
    assert (finding.level, finding.name) == (FindingLevel.MISSING, "spoken stop")
