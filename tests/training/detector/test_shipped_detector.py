import json
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from sim_twin.pictures.renderer import open_gl_context
from training.detector.dataset import Shard, draw_shard
from training.detector.evaluation import judge_file, run
from training.detector.files import FILES, METRICS
from training.detector.scenes.drawing import HEIGHT_PX, WIDTH_PX

SHIPPED = Path(__file__).parents[3] / "vla_deploy" / "models" / "detector"
NEVER_DRAWN_BEFORE = 9000
"""Number of a held-out scene that belongs to no set of images that a figure was made from."""


@pytest.fixture(scope="module")
def fresh() -> Iterator[Shard]:
    gl = open_gl_context(WIDTH_PX, HEIGHT_PX)
    yield draw_shard(gl, "heldout", NEVER_DRAWN_BEFORE, 0, count=12)
    gl.free()


@pytest.mark.gl
@pytest.mark.parametrize("name", FILES.values())
def test_fresh_unseen_scenes_are_seen_as_well_as_the_card_says(fresh: Shard, name: str) -> None:
    stated = json.loads((SHIPPED / METRICS).read_text())["splits"]["heldout"]["models"]

    figures = judge_file(SHIPPED / name, fresh)

    assert figures["labels"] >= 20
    assert figures["recall"] >= 0.8 * stated["fp32"]["recall"]


@pytest.mark.parametrize("name", FILES.values())
@pytest.mark.parametrize("level", [0, 128, 255])
def test_an_image_without_contents_shows_nothing(name: str, level: int) -> None:
    blank = np.full((1, HEIGHT_PX, WIDTH_PX, 3), level, np.uint8)

    (boxes,) = run(SHIPPED / name, blank)

    assert not (boxes.scores >= 0.3).any()


def test_the_files_are_small() -> None:
    sizes = {key: (SHIPPED / name).stat().st_size for key, name in FILES.items()}

    assert sizes["fp32"] <= 14 * 2**20  # 3.5 million weights
    assert max(sizes["int8_u8s8"], sizes["int8_s8s8"]) <= sizes["fp32"] / 2
