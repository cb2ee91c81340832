import dataclasses

import numpy as np
import pytest

from vla_deploy.inference.errors import ImagesInvalid, ModelMismatch, ModelUnknown
from vla_deploy.inference.manifest import Variant
from vla_deploy.model_tools.detectors.accuracy import (
    AccuracyCount,
    average_precision,
    measure_files,
    with_measured,
)
from vla_deploy.model_tools.detectors.labelled import Labels, read_labelled
from vla_deploy.perception.detectors.boxes import Boxes

HERE, THERE, NOWHERE = (0, 0, 10, 10), (50, 0, 60, 10), (90, 90, 99, 99)


def found(*rows: tuple[tuple[int, ...], float, int]) -> Boxes:
    return Boxes(
        corners_px=np.array([row[0] for row in rows], dtype=np.float32).reshape(-1, 4),
        scores=np.array([row[1] for row in rows], dtype=np.float32),
        classes=np.array([row[2] for row in rows], dtype=np.intp),
    )


def there(*rows: tuple[tuple[int, ...], int]) -> Labels:
    return Labels(
        corners_px=np.array([row[0] for row in rows], dtype=np.float32).reshape(-1, 4),
        classes=np.array([row[1] for row in rows], dtype=np.intp),
    )


@pytest.mark.parametrize(
    ("scores", "hits", "present", "expected"),
    [
        ([0.9, 0.8], [True, True], 2, 1.0),
        ([0.9, 0.8], [True, True], 4, 0.5),
        ([0.9, 0.8], [False, True], 1, 0.5),
        # Precision 1, then 2/3 at the second hit, which holds back to there.
        ([0.9, 0.8, 0.7], [True, False, True], 2, 0.5 * 1.0 + 0.5 * 2 / 3),
        # Precision 1/2 at the first hit and 2/3 at the second: 2/3 holds for both.
        ([0.9, 0.8, 0.7], [False, True, True], 2, 2 / 3),
        ([0.1, 0.9], [True, False], 1, 0.5),
        ([], [], 3, 0.0),
    ],
)
def test_average_precision_is_the_area_by_hand(scores, hits, present, expected):
    assert average_precision(scores, hits, present) == pytest.approx(expected)


def test_the_mean_is_over_the_classes_that_occur():
    count = AccuracyCount(("cup", "ball", "book"))
    count.add(found((HERE, 0.9, 0), (THERE, 0.8, 1)), there((HERE, 0), (NOWHERE, 1)))
    result = count.result()
    assert result.by_class == {"cup": 1.0, "ball": 0.0}
    assert (result.map50, result.images, result.things) == (0.5, 1, 2)


def test_a_thing_is_found_once_and_only_as_its_own_class():
    count = AccuracyCount(("cup", "ball"))
    count.add(found((HERE, 0.9, 0), (HERE, 0.8, 0), (HERE, 0.7, 1)), there((HERE, 0), (THERE, 1)))
    result = count.result()
    assert result.by_class == {"cup": 1.0, "ball": 0.0}


@pytest.mark.parametrize(("right", "hit"), [(10, 1.0), (20, 1.0), (21, 0.0)])
def test_a_hit_overlaps_by_one_half(right, hit):
    count = AccuracyCount(("cup",))
    count.add(found(((0, 0, right, 10), 0.9, 0)), there((HERE, 0)))
    assert count.result().map50 == hit


def test_images_in_which_nothing_is_labelled_tell_no_accuracy():
    count = AccuracyCount(("cup",))
    count.add(found((HERE, 0.9, 0)), there())
    with pytest.raises(ImagesInvalid, match="nothing is labelled in 1 images"):
        count.result()


def test_what_boxes_are_worth_counts_those_from_the_threshold_on_class_by_class():
    count = AccuracyCount(("cup", "ball", "book", "key"), 0.5)
    count.add(
        found((HERE, 0.9, 0), (THERE, 0.6, 0), (NOWHERE, 0.3, 0), (HERE, 0.8, 1)),
        there((HERE, 0), (NOWHERE, 0), (THERE, 2)),
    )
    measured = count.result().measured
    assert (measured.precision, measured.recall) == (0.333, 0.333)
    assert (measured.boxes, measured.things) == (3, 3)
    assert [dataclasses.astuple(one) for one in measured.classes] == [
        ("cup", 0.5, 0.5, 2, 2),
        ("ball", 0.0, 0.0, 1, 0),
        ("book", 0.0, 0.0, 0, 1),
    ]


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
