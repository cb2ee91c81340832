"""Each fault of an image by itself: what is seen of it, what it leaves, what is told."""

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from drivers.camera.base import RgbdFrame
from drivers.camera.protocol import Intrinsics
from vla_deploy.perception.geometry.cloud import DEPTH_SIGMA_PER_M
from vla_deploy.perception.images.frame_check import LIMITS, ImageUse, StatisticLimit, judge_frame
from vla_deploy.perception.images.frame_monitor import FrameMonitor
from vla_deploy.perception.images.frame_statistics import FrameStatistics, measure_frame
from vla_deploy.robots.floor_pose import Pose2D

WIDTH, HEIGHT = 160, 120
CAMERA = Intrinsics(width=WIDTH, height=HEIGHT, fx=140.0, fy=140.0, cx=79.5, cy=59.5)
HERE = Pose2D(1.0, 1.0, 0.0)
Image = np.ndarray
Change = Callable[[Image, Image, np.random.Generator], tuple[Image, Image]]


def room(seed: int = 0, shift_px: int = 0) -> tuple[Image, Image]:
    """Return a view of coloured blocks before a wall, with the noise that sensors have."""
    random = np.random.default_rng([seed, shift_px])
    blocks = np.random.default_rng(7).integers(60, 200, (6, 12, 3)).repeat(20, 0).repeat(20, 1)
    rgb = blocks[:, shift_px : shift_px + WIDTH] + random.normal(0.0, 2.0, (HEIGHT, WIDTH, 3))
    depth_m = 0.8 + 0.01 * np.arange(HEIGHT)[:, None] + np.zeros((1, WIDTH))
    depth_m = depth_m + DEPTH_SIGMA_PER_M * depth_m**2 * random.standard_normal(depth_m.shape)
    return rgb.clip(0, 255).astype(np.uint8), np.rint(1000.0 * depth_m).astype(np.uint16)


def frame(rgb: Image, depth: Image) -> RgbdFrame:
    return RgbdFrame(
        stamp_ns=0, sequence=0, intrinsics=CAMERA, depth_unit_m=0.001, rgb=rgb, depth=depth
    )


def turned(yaw_rad: float) -> Image:
    c, s = math.cos(yaw_rad), math.sin(yaw_rad)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def watch(*frames: RgbdFrame, turn_rad: float = 0.0, base: Pose2D = HERE) -> FrameMonitor:
    seen = FrameMonitor()
    for number, one in enumerate(frames):
        where = HERE if number == 0 else base
        seen.receive(one, 0)
        seen.judge(one, one.depth_m(), turned(number * turn_rad), where)
    return seen


def noisy(levels: float) -> Change:
    return lambda rgb, depth, random: (
        (rgb + random.normal(0.0, levels, rgb.shape)).clip(0, 255).astype(np.uint8),
        depth,
    )


def shaken_depth(factor: float) -> Change:
    def change(rgb: Image, depth: Image, random: np.random.Generator) -> tuple[Image, Image]:
        sigma_mm = factor * DEPTH_SIGMA_PER_M * depth.astype(float) ** 2 / 1000.0
        return rgb, (depth + sigma_mm * random.standard_normal(depth.shape)).astype(np.uint16)

    return change


def holes(share: float) -> Change:
    return lambda rgb, depth, random: (rgb, depth * (random.random(depth.shape) > share))


def half_empty(rgb: Image, depth: Image, random: np.random.Generator) -> tuple[Image, Image]:
    kept = np.arange(HEIGHT) < HEIGHT // 2
    return rgb * kept[:, None, None].astype(np.uint8), depth * kept[:, None].astype(np.uint16)


def painted(*colour: int) -> Change:
    return lambda rgb, depth, random: (np.full_like(rgb, colour), depth)


SPOILED: dict[str, tuple[Change, ImageUse]] = {
    "dark": (lambda rgb, depth, _: (rgb // 12, depth), ImageUse.OBSTACLES),
    "saturated": (lambda rgb, depth, _: (np.maximum(rgb, 253), depth), ImageUse.OBSTACLES),
    "plain": (painted(0, 135, 0), ImageUse.OBSTACLES),
    "noisy": (noisy(40.0), ImageUse.OBSTACLES),
    "grainy": (noisy(20.0), ImageUse.FORM),
    "cut off": (half_empty, ImageUse.NOTHING),
    "depth holes": (holes(0.96), ImageUse.NOTHING),
    "noisy depth": (shaken_depth(8.0), ImageUse.NOTHING),
}


def test_a_sound_image_is_good_for_all() -> None:
    assert watch(frame(*room(0)), frame(*room(1))).document(0) == {
        "use": "all",
        "faults": [],
        "refused": 0,
    }


@pytest.mark.parametrize("fault", SPOILED)
def test_a_spoiled_image_is_used_for_no_more_than_it_shows(fault: str) -> None:
    change, use = SPOILED[fault]
    rgb, depth = change(*room(), np.random.default_rng(1))
    verdict = judge_frame(measure_frame(rgb, depth.astype(np.float32) / np.float32(1000.0)))
    assert verdict.use is use
    assert [text.partition(":")[0] for text in verdict.faults] == [fault]


@pytest.mark.parametrize("colour", [(255, 0, 255), (128, 128, 128), (0, 0, 255)])
def test_one_colour_over_a_room_that_has_depth_is_none_of_its_own(
    colour: tuple[int, int, int],
) -> None:
    rgb, depth = room()
    told = watch(frame(np.full_like(rgb, colour), depth)).document(0)
    assert told["use"] == "obstacles"
    assert [fault.partition(":")[0] for fault in told["faults"]] == ["plain"]


@pytest.mark.parametrize(("noise_levels", "depth_mm"), [(0.0, 600), (2.0, 3000)])
def test_a_bare_wall_is_not_taken_for_a_plain_image(noise_levels: float, depth_mm: int) -> None:
    wall = np.random.default_rng(0).normal(190.0, noise_levels, (HEIGHT, WIDTH, 3))
    depth = np.full((HEIGHT, WIDTH), depth_mm, np.uint16)
    assert watch(frame(wall.astype(np.uint8), depth)).document(0)["faults"] == []


def test_an_image_of_the_same_bits_is_frozen_although_it_is_stamped_anew() -> None:
    seen = watch(frame(*room()), frame(*room()))
    (fault,) = seen.document(0)["faults"]
    assert fault.startswith("frozen: 1, limit 0.95")
    assert seen.document(0)["refused"] == 1


def test_depth_that_stands_still_beside_live_colours_is_frozen() -> None:
    depth = room()[1]
    frames = [frame(room(number, 2 * number)[0], depth) for number in range(3)]
    told = watch(*frames).document(0)
    assert told["use"] == "nothing"
    assert any(fault.startswith("frozen: 1, limit 0.95") for fault in told["faults"])


def test_a_row_with_hardly_any_depth_may_be_the_same_by_chance() -> None:
    thin = [np.zeros_like(room()[1]) for _ in range(2)]
    for one in thin:
        one[:, :3] = 500
    assert "frozen" not in str(watch(*(frame(room(1)[0], one) for one in thin)).document(0))


@pytest.mark.parametrize("rows", [12, 110])
def test_an_image_with_rows_of_the_one_before_is_torn(rows: int) -> None:
    (rgb, depth), (old_rgb, old_depth) = room(1, shift_px=20), room(0)
    rgb[:rows], depth[:rows] = old_rgb[:rows], old_depth[:rows]
    (fault,) = watch(frame(*room(0)), frame(rgb, depth)).document(0)["faults"]
    assert fault.startswith("torn")


def test_an_image_is_torn_with_one_that_came_and_was_not_judged() -> None:
    (rgb, depth), skipped = room(2, shift_px=40), frame(*room(1, shift_px=20))
    rgb[:60], depth[:60] = skipped.rgb[:60], skipped.depth[:60]
    seen, torn = watch(frame(*room(0))), frame(rgb, depth)
    seen.receive(skipped, 0)
    seen.receive(torn, 0)
    assert seen.judge(torn, torn.depth_m(), turned(0.0), HERE).use is ImageUse.NOTHING


@pytest.mark.parametrize(
    ("turn_rad", "base"), [(0.2, HERE), (0.0, Pose2D(1.5, 1.0, 0.0))], ids=["turns", "drives"]
)
def test_a_view_that_stays_while_the_camera_moves_is_frozen_although_it_is_noisy(
    turn_rad: float, base: Pose2D
) -> None:
    stuck = watch(frame(*room(0)), frame(*room(1)), turn_rad=turn_rad, base=base)
    (fault,) = stuck.document(0)["faults"]
    assert fault.startswith("frozen while the camera moved")
    moving = watch(frame(*room(0)), frame(*room(1, shift_px=20)), turn_rad=turn_rad, base=base)
    assert moving.document(0)["faults"] == []


@pytest.mark.parametrize("rows", [HEIGHT, 100])
def test_colours_that_stay_while_the_camera_moves_leave_obstacles(rows: int) -> None:
    (rgb, depth), (old_rgb, old_depth) = room(1, shift_px=4), room(0)
    rgb[:rows] = old_rgb[:rows]
    frames = frame(old_rgb, old_depth), frame(rgb, depth)
    stale = watch(*frames, base=Pose2D(1.1, 1.0, 0.0)).document(0)
    assert stale["use"] == "obstacles"
    assert [fault.partition(":")[0] for fault in stale["faults"]] == ["stale colours"]
    assert watch(*frames, base=Pose2D(1.01, 1.0, 0.0)).document(0)["faults"] == []


def test_colours_that_stay_are_stale_however_slowly_the_camera_moves() -> None:
    seen, rgb = FrameMonitor(), room(0)[0]
    uses = []
    for number in range(12):
        one = frame(rgb, room(number)[1])
        here = Pose2D(1.0 + 0.005 * number, 1.0, 0.0)
        uses.append(seen.judge(one, one.depth_m(), turned(0.0), here).use)
    assert uses[0] is ImageUse.ALL
    assert uses[-1] is ImageUse.OBSTACLES


@pytest.mark.parametrize("driven_m", [0.0, 0.5])
def test_a_wall_too_near_for_noise_in_its_depth_is_not_taken_for_frozen(driven_m: float) -> None:
    near = np.full((HEIGHT, WIDTH), 400, np.uint16)
    frames = [frame(room(number, 20 * number)[0], near) for number in range(2)]
    seen = watch(*frames, base=Pose2D(1.0 + driven_m, 1.0, 0.0))
    assert seen.document(0)["faults"] == []


@pytest.mark.parametrize("noise_seeds", [1, 1000], ids=["without noise", "noisy"])
def test_a_robot_at_rest_whose_yaw_drifts_has_not_moved_its_camera(noise_seeds: int) -> None:
    seen, second_ns = FrameMonitor(), 1_000_000_000
    drift_rad_s = math.radians(0.5) / 60.0
    for second in range(0, 1200, 4):
        rgb, depth = room(second % noise_seeds)[0], room(second)[1]
        one = replace(frame(rgb, depth), stamp_ns=second * second_ns)
        assert (
            seen.judge(one, one.depth_m(), turned(drift_rad_s * second), HERE).use is ImageUse.ALL
        )
    after = replace(frame(rgb, room(1200)[1]), stamp_ns=1200 * second_ns)
    verdict = seen.judge(after, after.depth_m(), turned(drift_rad_s * 1200 + 0.2), HERE)
    assert verdict.use is ImageUse.NOTHING


def test_a_bare_wall_looks_the_same_from_everywhere_and_is_not_taken_for_frozen() -> None:
    walls = [
        np.random.default_rng(seed).normal(120, 2, (HEIGHT, WIDTH, 3)).astype(np.uint8)
        for seed in range(2)
    ]
    frames = [frame(wall, room(seed)[1]) for seed, wall in enumerate(walls)]
    assert watch(*frames, turn_rad=0.5).document(0)["faults"] == []


def test_a_camera_that_sends_no_more_is_told() -> None:
    seen = watch(frame(*room()))
    assert seen.document(1_400_000_000)["use"] == "all"
    told = seen.document(3_000_000_000)
    assert told["use"] == "nothing"
    assert told["faults"] == ["no new image: 3, limit 1.5 (s since the last one)"]


@pytest.mark.parametrize("limit", LIMITS, ids=lambda limit: limit.fault)
def test_every_limit_is_one_that_a_sound_image_keeps(limit: StatisticLimit) -> None:
    assert limit.measure(FrameStatistics()) <= limit.most
    assert limit.leaves < ImageUse.ALL
