import json
from pathlib import Path

import cv2
import numpy as np
import pytest

from vla_deploy.cli.main import main
from vla_deploy.robots import load_robot
from vla_deploy.robots.maps.map_file import MapFile, MapMode, read_map_file, write_map_file

KEPT = load_robot("butler").home.map_path


def test_the_robots_own_map_fits_it(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["map", "check", str(KEPT), "--robot", "butler", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert (told["width_m"], told["height_m"], told["resolution_m"]) == (8.75, 6.7, 0.05)
    assert told["known_ratio"] == 1.0
    assert 15.0 < told["reachable_m2"] < told["free_m2"]
    assert told["faults"] == []


def test_a_map_on_which_places_are_walled_in_is_refused_with_their_names(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = read_map_file(KEPT)
    shades = file.shades.copy()
    shades[:, 95:98] = 0
    path = tmp_path / "walled.yaml"
    write_map_file(
        path, MapFile(shades=shades, resolution_m=file.resolution_m, origin_m=file.origin_m)
    )
    assert main(["map", "check", str(path), "--robot", "butler"]) == 1
    told = capsys.readouterr().out
    assert "place kitchen: no way from the start pose leads there" in told
    assert "place coffee_table" not in told


def test_a_map_is_shown_in_the_terminal_and_as_an_image(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["map", "show", str(KEPT)]) == 0
    drawn = capsys.readouterr().out
    assert "########" in drawn
    assert "oooo" in drawn
    assert "....." in drawn
    image = tmp_path / "flat.png"
    assert main(["map", "show", str(KEPT), "--png", str(image)]) == 0
    shown = cv2.imread(str(image), cv2.IMREAD_GRAYSCALE)
    assert np.array_equal(shown, read_map_file(KEPT).shades)


def test_a_map_of_another_mode_is_converted_without_a_change_of_meaning(tmp_path: Path) -> None:
    shades = np.array([[0, 20, 70], [100, 255, 50]], dtype=np.uint8)
    raw = MapFile(shades=shades, resolution_m=0.1, origin_m=(1.0, 2.0), mode=MapMode.RAW)
    write_map_file(tmp_path / "raw.yaml", raw)
    assert main(["map", "convert", str(tmp_path / "raw.yaml"), str(tmp_path / "tri.yaml")]) == 0
    back = read_map_file(tmp_path / "tri.yaml")
    assert back.mode is MapMode.TRINARY
    assert back.occupancy().tolist() == [[100, -1, -1], [0, -1, 100]]


def test_a_conversion_replaces_nothing_unasked(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    shades = np.array([[0, 100]], dtype=np.uint8)
    raw = MapFile(shades=shades, resolution_m=0.1, origin_m=(1.0, 2.0), mode=MapMode.RAW)
    for name in ("raw.yaml", "other.yaml"):
        write_map_file(tmp_path / name, raw)
    image = (tmp_path / "raw.pgm").read_bytes()
    # Its YAML file is free, but not the image beside it, and that is the image of the source.
    renamed = (tmp_path / "raw.yaml").rename(tmp_path / "old.yaml")

    assert main(["map", "convert", str(renamed), str(tmp_path / "raw.yaml"), "--replace"]) == 2
    assert main(["map", "convert", str(renamed), str(tmp_path / "other.yaml")]) == 2
    assert "--replace" in capsys.readouterr().err
    assert (tmp_path / "raw.pgm").read_bytes() == image
    assert main(["map", "convert", str(renamed), str(tmp_path / "other.yaml"), "--replace"]) == 0
    assert read_map_file(tmp_path / "other.yaml").mode is MapMode.TRINARY
