"""Measure the shipped detector: accuracy on images drawn for this run, speed, what it adds.

The images are drawn by the detector's training from a seed and numbers that no figure of its card
was made from: rooms, lights and textures that training does not show. `named_right_*` are shares of
things on random tables, seen whole, that got their class: by their form alone, and by both.
"""

import sys
from collections.abc import Iterator, Sequence
from contextlib import closing
from typing import Any, Final

import numpy as np

from benchmarks.command import parser, show
from benchmarks.perception_geometry import MATCH_M, cloud_of
from drivers.clock import MonotonicClock
from platforms import load_profile
from sim_twin.pictures.renderer import open_gl_context
from training.detector.average_precision import Rows
from training.detector.dataset import IMAGES_PER_SHARD, Shard, draw_shard
from training.detector.evaluation import RECALLS, judge_file
from training.detector.scenes.drawing import HEIGHT_PX, WIDTH_PX
from training.detector.scenes.table_scenes import TableScene, draw_scenes
from vla_deploy.inference.manifest import Variant
from vla_deploy.inference.roles import ModelShelf, choice_for
from vla_deploy.model_tools.detectors.benching import bench
from vla_deploy.perception.detectors.detector import ROLE, Detector, open_detector
from vla_deploy.perception.geometry.geometry_grid import geometry_grid
from vla_deploy.perception.geometry.supports import find_supports
from vla_deploy.perception.images.detection import Detection, detect
from vla_deploy.perception.images.network_view import NetworkView
from vla_deploy.perception.naming.classes import OTHER
from vla_deploy.runtime.state_dir import user_base

FIRST_FRESH: Final = 20_000
"""Number of the first held-out stage that belongs to no other set of images."""


def measure(images: int = 100, scenes: int = 48, seed: int = 0) -> dict[str, Any]:
    """Return accuracy, speed and shares of right names of the shipped detector.

    Raises:
        InferenceError: it cannot be opened.
        OpenGLMissing: nothing can be rendered on this machine.
    """
    shelf = ModelShelf.of_base(user_base(), MonotonicClock())
    drawn = _draw(images, seed)
    with closing(open_detector(shelf, load_profile("desktop"), 0)) as detector:
        names = _names(detector, scenes, seed)
    return {"images": len(drawn.images), **_accuracy(shelf, drawn), **_speed(shelf, drawn), **names}


def _draw(images: int, seed: int) -> Shard:
    """Draw labelled held-out images, a stage for each twenty."""
    gl = open_gl_context(WIDTH_PX, HEIGHT_PX)
    counts = [min(IMAGES_PER_SHARD, images - n) for n in range(0, images, IMAGES_PER_SHARD)]
    shards = [
        draw_shard(gl, "heldout", FIRST_FRESH + number, seed, count)
        for number, count in enumerate(counts)
    ]
    gl.free()
    return Shard(
        images=np.concatenate([shard.images for shard in shards]),
        labels=np.concatenate(list(_counted_through(shards))),
    )


def _counted_through(shards: Sequence[Shard]) -> Iterator[Rows]:
    """Yield label rows whose first column counts the images of all shards."""
    start = 0
    for shard in shards:
        rows = shard.labels.copy()
        rows[:, 0] += start
        start += len(shard.images)
        yield rows


def _accuracy(shelf: ModelShelf, drawn: Shard) -> dict[str, Any]:
    model = shelf.store.load("detector")
    told = {"fp32": Variant.FP32, "int8": Variant.INT8_U8S8, "int8_s8s8": Variant.INT8_S8S8}
    figures = {
        name: judge_file(model.folder / model.manifest.files[variant].path, drawn)
        for name, variant in told.items()
    }
    return {
        "labels": figures["fp32"]["labels"],
        **{f"map50_{name}": one["map50"] for name, one in figures.items()},
        **{f"{key}_{name}": one[key] for key in RECALLS for name, one in figures.items()},
    }


def _speed(shelf: ModelShelf, drawn: Shard) -> dict[str, Any]:
    """Run the files in turn, as a CPU takes them, on each image once: load hits each alike."""
    choice, images = choice_for(ROLE, load_profile("desktop")), list(drawn.images)
    measured = bench(shelf, shelf.store.load("detector"), choice, images, len(images))
    return {
        "int8_speedup": measured.int8_speedup,
        "provider": measured.rows[-1].provider,
        **{f"run_median_s_{row.variant}": row.run_median_s for row in measured.rows},
        **{f"frame_p95_s_{row.variant}": row.frame_p95_s for row in measured.rows},
        **{f"memory_mb_{row.variant}": row.memory_mb for row in measured.rows},
    }


def _names(detector: Detector, scenes: int, seed: int) -> dict[str, Any]:
    """Compare names with the truth, given by the form alone and by form and network."""
    right = {"form": 0, "both": 0}
    sure_and_wrong = {"form": 0, "both": 0}
    things = 0
    for scene in draw_scenes(scenes, seed):
        told = {"form": _detections(scene, None), "both": _detections(scene, detector)}
        for truth in scene.truths:
            seen = {how: _nearest(truth.position_m, found) for how, found in told.items()}
            if any(one is None for one in seen.values()):
                continue
            things += 1
            for how, one in seen.items():
                assert one is not None, "looked at above"
                right[how] += one.class_name == truth.class_name
                wrong = one.class_name not in (truth.class_name, OTHER)
                sure_and_wrong[how] += wrong and one.confidence > 0.7
    return {
        "named_things": things,
        **{f"named_right_ratio_{how}": count / max(things, 1) for how, count in right.items()},
        **{
            f"named_wrong_and_sure_ratio_{how}": count / max(things, 1)
            for how, count in sure_and_wrong.items()
        },
    }


def _detections(scene: TableScene, detector: Detector | None) -> list[Detection]:
    cloud, view = cloud_of(scene), None
    if detector is not None:
        seen = NetworkView.of(detector.detect(scene.rgb), detector.detection)
        view = geometry_grid(scene.camera).view(seen)
    return detect(cloud, find_supports(cloud), view)


def _nearest(place: tuple[float, float, float], found: Sequence[Detection]) -> Detection | None:
    """Return what was seen whole at a thing's place."""
    gaps = [
        (float(np.hypot(one.position_m[0] - place[0], one.position_m[1] - place[1])), number)
        for number, one in enumerate(found)
        if not (one.truncated or one.occluded)
    ]
    gap_m, number = min(gaps, default=(np.inf, -1))
    return found[number] if gap_m < MATCH_M else None


def main(argv: Sequence[str] | None = None) -> int:
    """Print the figures."""
    arguments = parser("perception_network", __doc__)
    arguments.add_argument("--images", type=int, default=100)
    arguments.add_argument("--scenes", type=int, default=48)
    arguments.add_argument("--seed", type=int, default=0)
    given = arguments.parse_args(argv)
    show(measure(given.images, given.scenes, given.seed), as_json=given.json)
    return 0


if __name__ == "__main__":
    sys.exit(main())
