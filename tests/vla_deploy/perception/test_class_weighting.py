"""How far a network is believed, class by class, and by which words the robot knows its classes."""

from dataclasses import replace

import pytest

from tests.vla_deploy.image_inputs import letterboxed
from vla_deploy.inference.manifest import (
    ClassMeasured,
    DetectionOutputs,
    Measured,
)
from vla_deploy.perception.naming.class_fusion import (
    ClassVote,
    NameSource,
    chance_of,
    fuse_name,
    name_by_form,
)
from vla_deploy.perception.naming.class_weighting import (
    CLASS_SYNONYMS,
    ClassReliability,
    class_reliabilities,
    robot_class,
)
from vla_deploy.perception.naming.classes import FURNITURE, OTHER, POSSIBLE, Form

COCO = DetectionOutputs(
    adapter="yolo",
    classes=("cell phone", "sports ball", "dining table", "teddy bear"),
    score_threshold=0.25,
    iou_threshold=0.45,
    image=letterboxed(640, 640),
)
PHONE = Form(name="phone", fits=frozenset({"phone"}), impossible=frozenset({FURNITURE}))
SHAPELESS = Form(name=OTHER, fits=frozenset(), impossible=frozenset({FURNITURE}))


def measured(*rows: ClassMeasured) -> DetectionOutputs:
    return replace(COCO, measured=Measured(precision=0.9, recall=0.8, classes=rows))


def row(name: str, precision: float, recall: float, count: int) -> ClassMeasured:
    return ClassMeasured(name=name, precision=precision, recall=recall, boxes=count, things=count)


def test_a_networks_classes_go_by_the_robots_own_words() -> None:
    assert [one.class_name for one in class_reliabilities(COCO)] == [
        "phone",
        "ball",
        FURNITURE,
        "teddy bear",
    ]


@pytest.mark.parametrize("told", ["Cell Phone", "cell_phone", "cell-phone", " cell  phone"])
def test_spelling_makes_no_other_class(told: str) -> None:
    assert robot_class(told) == "phone"


def test_every_other_word_stands_for_something_that_the_robot_knows() -> None:
    assert set(CLASS_SYNONYMS.values()) <= {*POSSIBLE, "person", "chair", FURNITURE}
    assert all(CLASS_SYNONYMS[name] == name for name in CLASS_SYNONYMS.values())


@pytest.mark.parametrize("near", ["wine glass", "vase", "suitcase", "handbag", "laptop", "spoon"])
def test_what_only_resembles_a_kind_keeps_its_own_name(near: str) -> None:
    assert robot_class(near) == near


def test_many_boxes_count_as_they_were_measured_and_few_for_little() -> None:
    many, few, *_ = class_reliabilities(
        measured(row("cell phone", 1.0, 1.0, 990), row("sports ball", 1.0, 1.0, 2))
    )
    assert (many.precision, many.recall) == pytest.approx((0.995, 0.99))
    assert (few.precision, few.recall) == pytest.approx((7 / 12, 2 / 12))


def test_a_class_that_no_labelled_image_showed_counts_as_unmeasured() -> None:
    reliabilities = class_reliabilities(measured(row("cell phone", 0.9, 0.8, 500)))
    assert reliabilities[3] == ClassReliability(class_name="teddy bear", precision=0.5, recall=0.0)


def test_figures_without_counts_count_for_every_class_as_they_were_stated() -> None:
    reliabilities = class_reliabilities(replace(COCO, measured=Measured(precision=0.8, recall=0.7)))
    assert {(one.precision, one.recall) for one in reliabilities} == {(0.8, 0.7)}


@pytest.mark.parametrize("form", [PHONE, SHAPELESS], ids=["a phone's form", "no form"])
@pytest.mark.parametrize("said", [2, 3], ids=["furniture", "unmeasured class"])
def test_words_that_say_nothing_of_the_kind_never_raise_a_names_confidence(
    form: Form, said: int
) -> None:
    voice = class_reliabilities(
        measured(row("cell phone", 0.95, 0.9, 500), row("dining table", 0.95, 0.9, 500))
    )[said]
    word = ClassVote(class_name=voice.class_name, chance=chance_of(0.99, voice.precision))
    name = fuse_name(form, [word])
    alone = name_by_form(form)
    assert (name.class_name, name.source) in {(form.name, alone.source), (OTHER, NameSource.NONE)}
    assert name.confidence <= alone.confidence


def test_a_measured_word_for_a_cell_phone_makes_a_phone_surer() -> None:
    phone = class_reliabilities(measured(row("cell phone", 0.95, 0.9, 500)))[0]
    word = ClassVote(class_name=phone.class_name, chance=chance_of(0.9, phone.precision))
    name = fuse_name(PHONE, [word])
    assert (name.class_name, name.source) == ("phone", NameSource.BOTH)
    assert name.confidence > name_by_form(PHONE).confidence
