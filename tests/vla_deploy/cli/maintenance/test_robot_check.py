"""`vla-deploy check` of a robot: where its hands get to, and where its twin stands."""

import shutil
import tomllib
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import Any

import pytest

from vla_deploy.ipc import topics
from vla_deploy.robots import load_robot
from vla_deploy.robots.camera import MOST_PIXELS
from vla_deploy.robots.loader import ROBOTS_DIR


@pytest.fixture
def mine(tmp_path: Path) -> Path:
    return Path(shutil.copytree(ROBOTS_DIR / "so101", tmp_path / "my_arm"))


def change(folder: Path, *pairs: tuple[str, str]) -> None:
    file = folder / "robot.toml"
    text = file.read_text(encoding="utf-8")
    for before, after in pairs:
        assert before in text
        text = text.replace(before, after)
    file.write_text(text, encoding="utf-8")


@pytest.mark.parametrize(
    ("world", "fault"),
    [
        ("moon", "twin.world: got 'moon', expected a world of the twin: pair_table, small_table"),
        ("flat", "twin.world: got 'flat', which has no [mount] for a robot that does not drive"),
    ],
)
def test_all_that_does_not_fit_is_said_at_once(
    vla: Callable[..., Any], mine: Path, world: str, fault: str
) -> None:
    change(mine, ('world = "table"', f'world = "{world}"'), ("[0.22, 0.28]", "[0.22, 0.6]"))
    said = vla("check", "--robot", mine)
    assert said.code == 2
    assert fault in said.err
    assert "reach.distances_m[1]: got 0.6, expected one that a hand gets to" in said.err
    assert f"vla-deploy robot reach --robot {mine}" in said.err


def test_an_image_that_has_no_room_is_refused(vla: Callable[..., Any], mine: Path) -> None:
    change(mine, ("width = 640", "width = 1280"), ("height = 480", "height = 720"))
    said = vla("check", "--robot", mine)
    assert said.code == 2
    assert "camera.width, camera.height: got 1280 x 720, expected at most 307200" in said.err
    assert topics.RGBD.slot_bytes == MOST_PIXELS * 5  # colour, and depth of two bytes


def test_an_arm_without_a_reach_gets_one_that_check_accepts_and_a_person_measured(
    vla: Callable[..., Any], mine: Path
) -> None:
    file = mine / "robot.toml"
    before, _, table = file.read_text().partition("[reach]\n")
    file.write_text(before + table.partition("\n\n")[2])
    refused = vla("check", "--robot", mine)
    assert refused.code == 2
    assert "reach: got nothing" in refused.err
    printed = vla("robot", "reach", "--robot", mine)
    assert set(tomllib.loads(printed.out)) == {"reach"}
    file.write_text(f"{file.read_text()}\n{printed.out}")
    assert vla("check", "--robot", mine).code == 0
    found, written = asdict(load_robot(mine).reach), asdict(load_robot("so101").reach)
    for key in ("distances_m", "most_aside_m", "grip_heights_m", "out_m", "above_m", "apart_m"):
        assert found[key] == pytest.approx(written[key], abs=0.031), key
