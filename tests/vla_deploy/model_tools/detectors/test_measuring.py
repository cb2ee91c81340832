import dataclasses

import pytest

from vla_deploy.inference.errors import ImagesInvalid, ModelMismatch, ModelUnknown
from vla_deploy.inference.manifest import Variant
from vla_deploy.model_tools.detectors.labelled import read_labelled
from vla_deploy.model_tools.detectors.measuring import measure_files, with_measured


@pytest.fixture
def measured(shelf, photographs):
    """Measure with six photographs, as they are labelled."""

    def measured(model):
        labelled = read_labelled(photographs(), ("red", "green", "blue"))
        return measure_files(model, labelled, engines=shelf.engines, clock=shelf.clock)

    return measured


def test_what_was_measured_is_read_from_the_manifest_again(shelf, installed, measured):
    accuracy = measured(installed())
    kept = shelf.store.load("blobs").manifest.detection.measured
    assert kept == accuracy[Variant.FP32].measured
    assert (kept.precision, kept.recall, kept.things) == (1.0, 1.0, 18)
    assert sum(one.things for one in kept.classes) == 18


def test_boxes_that_a_robot_would_not_act_on_are_not_counted(shelf, installed, measured):
    model = installed()
    detection = dataclasses.replace(model.manifest.detection, score_threshold=0.9999)
    strict = dataclasses.replace(model.manifest, detection=detection)
    accuracy = measured(dataclasses.replace(model, manifest=strict))[Variant.FP32]
    assert accuracy.map50 == 1.0
    assert accuracy.measured.recall < 1.0


def test_the_file_that_sees_worst_counts(installed, measured):
    model = installed()
    (good,) = measured(model).values()
    bad = dataclasses.replace(
        good, map50=0.5, measured=dataclasses.replace(good.measured, precision=0.4)
    )
    manifest = with_measured(model.manifest, {Variant.FP32: good, Variant.INT8_U8S8: bad})
    assert manifest.detection.measured.precision == 0.4


def test_a_model_of_the_software_is_left_as_it_was_published(installed, measured):
    with pytest.raises(ModelUnknown, match="comes with the software"):
        measured(dataclasses.replace(installed(), is_embedded=True))


def test_what_is_no_detector_or_has_nothing_to_be_measured_with_is_told(shelf, installed, measured):
    model = installed()
    with pytest.raises(ImagesInvalid, match="expected labelled images"):
        measure_files(model, [], engines=shelf.engines, clock=shelf.clock)
    other = dataclasses.replace(model.manifest, detection=None)
    with pytest.raises(ModelMismatch, match="expected a detector"):
        measured(dataclasses.replace(model, manifest=other))
