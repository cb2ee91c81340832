"""Measure how well things are placed in 3-D, and whether the stated errors are the real ones.

Random things stand and lie on random tables in rooms of the twin, 0.4 to 1.2 m from the camera,
with the depth noise of its camera. Errors are those of one image against the truth. What perception
itself takes for half hidden counts as `unsure`, what it does not see as `missing`. `in_ellipse` is
the share of places within the stated 95 % ellipse on the floor plan; it is to be 0.95 and counts
the unsure ones, too.
"""

import math
import sys
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from benchmarks.command import parser, show
from training.detector.scenes.table_scenes import TableScene, Truth, draw_scenes
from vla_deploy.perception.geometry.cloud import Cloud, make_cloud
from vla_deploy.perception.geometry.geometry_grid import geometry_grid
from vla_deploy.perception.geometry.supports import find_supports
from vla_deploy.perception.images.detection import Detection, detect

MATCH_M: Final = 0.08
# Of a nearly square thing nobody can say which side is its length.
OBLONG_RATIO: Final = 1.2
CHI2_95: Final = {1: 3.841, 2: 5.991}


@dataclass(frozen=True, slots=True)
class Pair:
    """Hold a thing as it is and as it was seen; None where it was not."""

    truth: Truth
    seen: Detection | None

    @property
    def is_sure(self) -> bool:
        """Return whether perception took it for seen whole."""
        return self.seen is not None and not (self.seen.truncated or self.seen.occluded)


def measure(scenes: int = 96, seed: int = 0) -> dict[str, Any]:
    """Return errors of standing things, of lying ones, and how honest the stated errors are.

    Raises:
        OpenGLMissing: nothing can be rendered on this machine.
    """
    pairs = [pair for scene in draw_scenes(scenes, seed) for pair in look(scene)]
    return {
        "scenes": scenes,
        **_errors("standing", [pair for pair in pairs if pair.truth.stands]),
        **_errors("lying", [pair for pair in pairs if not pair.truth.stands]),
        **_yaw_errors([pair for pair in pairs if not pair.truth.stands]),
        **_honesty([pair for pair in pairs if pair.seen is not None]),
        "per_class_xy_mm": _per_class(pairs),
    }


def look(scene: TableScene) -> list[Pair]:
    """Return each thing of a scene with what perception says is there."""
    cloud = cloud_of(scene)
    found = detect(cloud, find_supports(cloud))
    return [Pair(truth, _nearest(truth, found)) for truth in scene.truths]


def cloud_of(scene: TableScene) -> Cloud:
    """Return the points of a scene on the grid on which the robot measures."""
    grid = geometry_grid(scene.camera)
    rgb, depth_m = grid.colours(scene.rgb), grid.depth(scene.depth_m)
    return make_cloud(rgb, depth_m, grid.camera, scene.base_from_camera)


def _nearest(truth: Truth, found: Iterable[Detection]) -> Detection | None:
    def gap_m(one: Detection) -> float:
        return math.dist(one.position_m[:2], truth.position_m[:2])

    near = min(found, key=gap_m, default=None)
    return near if near is not None and gap_m(near) < MATCH_M else None


def _errors(kind: str, pairs: Sequence[Pair]) -> dict[str, Any]:
    offsets = np.array(
        [np.subtract(p.seen.position_m, p.truth.position_m) for p in pairs if p.seen and p.is_sure]
    )
    xy_mm = 1000.0 * np.linalg.norm(offsets[:, :2], axis=1)
    return {
        f"{kind}_things": len(pairs),
        f"{kind}_missing": sum(pair.seen is None for pair in pairs),
        f"{kind}_unsure": sum(pair.seen is not None and not pair.is_sure for pair in pairs),
        f"{kind}_xy_median_mm": float(np.median(xy_mm)),
        f"{kind}_xy_p90_mm": float(np.percentile(xy_mm, 90.0)),
        f"{kind}_z_median_mm": 1000.0 * float(np.median(np.abs(offsets[:, 2]))),
    }


def _yaw_errors(pairs: Sequence[Pair]) -> dict[str, Any]:
    degrees = [
        math.degrees(abs(_yaw_error(pair.truth, pair.seen)))
        for pair in pairs
        if pair.seen and pair.is_sure and _is_oblong(pair.truth)
    ]
    return {
        "lying_yaw_median_deg": float(np.median(degrees)),
        "lying_yaw_p90_deg": float(np.percentile(degrees, 90.0)),
    }


def _honesty(pairs: Sequence[Pair]) -> dict[str, Any]:
    """Return the shares of squared errors, over what was stated, that keep within 95 %."""
    xy, z, yaw = [], [], []
    for truth, seen in ((pair.truth, pair.seen) for pair in pairs):
        assert seen is not None, "the caller has left the missing ones out"
        off = np.subtract(seen.position_m, truth.position_m)
        stated = np.array(seen.covariance_m2)
        xy.append(float(off[:2] @ np.linalg.solve(stated[:2, :2], off[:2])))
        z.append(float(off[2] ** 2 / stated[2, 2]))
        if not truth.stands and _is_oblong(truth):
            yaw.append((_yaw_error(truth, seen) / seen.yaw_sigma_rad) ** 2)
    return {
        "in_ellipse": float(np.mean(np.array(xy) < CHI2_95[2])),
        "in_height_interval": float(np.mean(np.array(z) < CHI2_95[1])),
        "in_yaw_interval": float(np.mean(np.array(yaw) < CHI2_95[1])),
        "normalised_error_squared_median": float(np.median(xy)),
    }


def _is_oblong(truth: Truth) -> bool:
    return truth.size_m[0] > OBLONG_RATIO * truth.size_m[1]


def _yaw_error(truth: Truth, seen: Detection) -> float:
    return math.remainder(seen.yaw_rad - truth.yaw_rad, math.pi)


def _per_class(pairs: Sequence[Pair]) -> dict[str, list[float]]:
    """Return the median and the 90th percentile for each class, standing or lying."""
    groups: dict[str, list[float]] = {}
    for pair in pairs:
        if pair.seen and pair.is_sure:
            name = f"{pair.truth.class_name} {'standing' if pair.truth.stands else 'lying'}"
            off = np.subtract(pair.seen.position_m, pair.truth.position_m)[:2]
            groups.setdefault(name, []).append(1000.0 * float(np.linalg.norm(off)))
    return {
        name: [round(float(np.percentile(values, share)), 2) for share in (50.0, 90.0)]
        for name, values in sorted(groups.items())
    }


def main(argv: Sequence[str] | None = None) -> int:
    """Measure and print."""
    arguments = parser("perception_geometry", __doc__)
    arguments.add_argument("--scenes", type=int, default=96, help="how many (default: 96)")
    arguments.add_argument("--seed", type=int, default=0, help="of the scenes (default: 0)")
    chosen = arguments.parse_args(argv)
    show(measure(chosen.scenes, chosen.seed), as_json=chosen.json)
    return 0


if __name__ == "__main__":
    sys.exit(main())
