import subprocess
import sys
from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from vla_deploy.robots import load_robot
from vla_deploy.robots.errors import MapInvalid
from vla_deploy.robots.maps.grid_map import grid_of
from vla_deploy.robots.maps.map_file import (
    FREE_SHADE,
    LOW_SHADE,
    OCCUPIED_SHADE,
    UNKNOWN_SHADE,
    MapFile,
    MapMode,
    read_map_file,
    write_map_file,
)

# As map_saver of ROS 1 and of Nav2, and a YAML library, write them.
ROS_1 = """image: map.pgm
resolution: 0.050000
origin: [-10.000000, -7.500000, 0.000000]
negate: 0
occupied_thresh: 0.65
free_thresh: 0.196

"""
NAV2 = """image: "map.pgm"
mode: trinary
resolution: 0.05
origin: [-10., -7.5, 0]
negate: 0
occupied_thresh: 0.65
free_thresh: 0.25
"""
DUMPED = """---
free_thresh: 0.25
image: map.pgm
mode: scale
negate: false
occupied_thresh: 0.65
origin:
- -10.0
- -7.5
- 0.0
resolution: 0.05
"""
SHADES = np.array(
    [[OCCUPIED_SHADE, UNKNOWN_SHADE, FREE_SHADE], [LOW_SHADE, 130, FREE_SHADE]], dtype=np.uint8
)


def lay_out(folder: Path, yaml: str = ROS_1, shades: np.ndarray = SHADES) -> Path:
    pixels = f"P5\n# CREATOR: map_saver 0.050 m/pix\n{shades.shape[1]} {shades.shape[0]}\n255\n"
    (folder / "map.pgm").write_bytes(pixels.encode() + shades.tobytes())
    path = folder / "map.yaml"
    path.write_text(yaml)
    return path


@pytest.mark.parametrize("yaml", [ROS_1, NAV2, DUMPED], ids=["ROS 1", "Nav2", "YAML library"])
def test_what_map_servers_write_is_read(tmp_path: Path, yaml: str) -> None:
    file = read_map_file(lay_out(tmp_path, yaml))
    assert (file.resolution_m, file.origin_m, file.negate) == (0.05, (-10.0, -7.5), False)
    assert np.array_equal(file.shades, SHADES)
    occupancy = file.occupancy()
    assert occupancy[1].tolist()[0::2] == [100, 0]
    assert occupancy[0, 0] == 100


def test_each_mode_means_what_map_server_means_by_it() -> None:
    def of(mode: MapMode, negate: bool = False) -> list[int]:
        shades = np.array([[0, 50, 100, 130, 205, 254, 255]], dtype=np.uint8)
        file = MapFile(
            shades=shades, resolution_m=0.1, origin_m=(0.0, 0.0), mode=mode, negate=negate
        )
        return file.occupancy()[0].tolist()

    assert of(MapMode.TRINARY) == [100, 100, -1, -1, -1, 0, 0]
    assert of(MapMode.TRINARY, negate=True) == [0, -1, -1, -1, 100, 100, 100]
    # 1 - 100 / 255 = 0.608 lies (0.608 - 0.196) / (0.65 - 0.196) = 91 % on the way.
    assert of(MapMode.SCALE) == [100, 100, 91, 65, 0, 0, 0]
    assert of(MapMode.RAW) == [0, 50, 100, -1, -1, -1, -1]


@given(
    shades=arrays(np.uint8, st.tuples(st.integers(1, 9), st.integers(1, 9))),
    resolution_m=st.floats(0.01, 1.0),
    origin_m=st.tuples(st.floats(-1e3, 1e3), st.floats(-1e3, 1e3)),
    mode=st.sampled_from(MapMode),
    negate=st.booleans(),
    thresholds=st.tuples(st.floats(0.0, 0.49), st.floats(0.5, 1.0)),
)
def test_what_is_written_is_read_back_to_the_bit(
    tmp_path_factory: pytest.TempPathFactory,
    shades: np.ndarray,
    resolution_m: float,
    origin_m: tuple[float, float],
    mode: MapMode,
    negate: bool,
    thresholds: tuple[float, float],
) -> None:
    file = MapFile(
        shades=shades,
        resolution_m=resolution_m,
        origin_m=origin_m,
        mode=mode,
        negate=negate,
        free_thresh=thresholds[0],
        occupied_thresh=thresholds[1],
    )
    path = tmp_path_factory.getbasetemp() / "round" / "trip.yaml"
    write_map_file(path, file, comment="by a test\nin two lines")
    back = read_map_file(path)
    assert np.array_equal(back.shades, shades)
    assert (back.resolution_m, back.origin_m, back.mode) == (resolution_m, origin_m, mode)
    assert (back.negate, back.free_thresh, back.occupied_thresh) == (negate, *thresholds)


def test_the_robots_own_map_survives_a_round_trip_byte_by_byte(tmp_path: Path) -> None:
    kept = load_robot("butler").home.map_path
    write_map_file(tmp_path / "flat.yaml", read_map_file(kept))
    assert (tmp_path / "flat.pgm").read_bytes() == kept.with_suffix(".pgm").read_bytes()


def test_a_map_without_black_has_walls_all_the_same(tmp_path: Path) -> None:
    grey = np.where(SHADES == OCCUPIED_SHADE, 70, SHADES).astype(np.uint8)
    grid = grid_of(read_map_file(lay_out(tmp_path, shades=grey)))
    assert grid.seen_by_lidar is not None
    assert np.argwhere(grid.seen_by_lidar).tolist() == [[0, 0], [1, 0]]


def test_a_png_is_as_good_as_a_pgm(tmp_path: Path) -> None:
    cv2.imwrite(str(tmp_path / "map.png"), SHADES)
    path = lay_out(tmp_path, ROS_1.replace("map.pgm", "map.png"))
    assert np.array_equal(read_map_file(path).shades, SHADES)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("0.050000", "0", "resolution: expected metres"),
        ("0.050000", "nan", "resolution: expected metres"),
        ("0.050000", "5 cm", "resolution: expected metres"),
        ("0.000000]", "1.57]", "drawn straight"),
        ("[-10.000000, -7.500000, 0.000000]", "[-10, -7.5]", "origin: expected"),
        ("[-10.000000, -7.500000, 0.000000]", "[a, b, c]", "origin: expected"),
        ("[-10.000000, -7.500000, 0.000000]", "[1e9, 0, 0]", "origin: expected"),
        ("[-10.000000, -7.500000, 0.000000]", "[nan, 0, 0]", "origin: expected"),
        ("[-10.000000, -7.500000, 0.000000]", "[0, nan, 0]", "origin: expected"),
        ("0.196", "0.9", "rising"),
        ("0.65", "65", "rising"),
        ("negate: 0", "negate: maybe", "negate: expected"),
        ("negate: 0", "mode: binary", "mode: expected trinary, scale, raw"),
        ("image: map.pgm", "", "missing image"),
        ("resolution: 0.050000", "", "missing resolution"),
        ("map.pgm", "gone.pgm", "no such file"),
        ("negate: 0", "negate", "map.yaml:4: expected `key: value`"),
    ],
)
def test_a_bad_value_is_told_with_place_and_expectation(
    tmp_path: Path, old: str, new: str, message: str
) -> None:
    assert old in ROS_1
    with pytest.raises(MapInvalid, match=message):
        read_map_file(lay_out(tmp_path, ROS_1.replace(old, new)))


def test_all_faults_are_told_at_once(tmp_path: Path) -> None:
    yaml = ROS_1.replace("0.050000", "-1").replace("0.65", "0.1")
    with pytest.raises(MapInvalid, match=r"resolution: .*; free_thresh"):
        read_map_file(lay_out(tmp_path, yaml))


@pytest.mark.parametrize("content", [b"", b"P5\n3 2\n255\n\0", b"\x89PNG\r\n\x1a\nrubbish", b"P5"])
def test_a_broken_image_is_told(tmp_path: Path, content: bytes) -> None:
    path = lay_out(tmp_path)
    (tmp_path / "map.pgm").write_bytes(content)
    with pytest.raises(MapInvalid, match="cannot be read"):
        read_map_file(path)


def test_a_yaml_that_is_no_text_is_told(tmp_path: Path) -> None:
    (tmp_path / "map.yaml").write_bytes(b"\xff\xfe\x00image")
    with pytest.raises(MapInvalid, match="it is no text"):
        read_map_file(tmp_path / "map.yaml")


def test_transparent_cells_are_refused_and_opaque_ones_read(tmp_path: Path) -> None:
    path = tmp_path / "flat.yaml"
    write_map_file(path, MapFile(shades=np.full((3, 4), 254, np.uint8), resolution_m=0.05,
                                 origin_m=(0.0, 0.0)))  # fmt: skip
    path.write_text(path.read_text().replace("flat.pgm", "flat.png"))
    pixels = np.full((3, 4, 4), 254, np.uint8)
    pixels[..., 3] = 255
    cv2.imwrite(str(tmp_path / "flat.png"), pixels)
    assert read_map_file(path).occupancy().tolist() == np.zeros((3, 4)).tolist()
    pixels[1, 2] = 0
    cv2.imwrite(str(tmp_path / "flat.png"), pixels)
    with pytest.raises(MapInvalid, match=r"found transparent cells.*in the shade 205"):
        read_map_file(path)


WITHOUT_OPENCV = """
import sys
import subprocess
import sys
from pathlib import Path
sys.modules["cv2"] = None
from vla_deploy.robots.errors import MapInvalid
from vla_deploy.robots.maps.map_file import read_map_file
try:
    print(read_map_file(Path(sys.argv[1])).shades.tolist())
except MapInvalid as error:
    print(error)
"""


def test_a_binary_pgm_is_read_without_opencv_and_others_are_refused(tmp_path: Path) -> None:
    def read(path: Path) -> str:
        words = [sys.executable, "-c", WITHOUT_OPENCV, str(path)]
        return subprocess.run(words, capture_output=True, text=True, check=True).stdout.strip()

    path = lay_out(tmp_path)
    assert read(path) == str(SHADES.tolist())
    (tmp_path / "map.pgm").write_text("P2 1 1 255 7")
    assert read(path).endswith("binary PGM of eight bits: this Python has no OpenCV to read others")


def test_a_pgm_that_ends_too_early_is_refused(tmp_path: Path) -> None:
    path = lay_out(tmp_path)
    (tmp_path / "map.pgm").write_bytes(b"P5 400 300 255\n" + bytes(7))
    with pytest.raises(MapInvalid, match="cannot be read"):
        read_map_file(path)
