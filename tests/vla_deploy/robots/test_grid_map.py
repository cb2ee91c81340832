from itertools import pairwise
from pathlib import Path

import cv2
import numpy as np
import pytest

from vla_deploy.navigation.path_planning import PathPlanner
from vla_deploy.robots.description import KeepOutZone
from vla_deploy.robots.errors import MapInvalid
from vla_deploy.robots.maps.grid_map import GridMap, load_map, with_zones

YAML = """# a flat
image: flat.pgm
resolution: 0.1
origin: [-1.0, -2.0, 0.0]
negate: 0
occupied_thresh: 0.65
free_thresh: 0.196
"""
ZONE = KeepOutZone(
    name="stairs", reason="a drop", polygon_m=((2.0, 1.0), (3.0, 1.0), (3.0, 4.0), (2.0, 4.0))
)


def write(folder: Path, yaml: str = YAML) -> Path:
    image = np.full((4, 6), 254, dtype=np.uint8)
    image[0, 0] = 0  # top left: the northernmost row
    image[3, 5] = 205  # unknown
    image[3, 4] = 60  # a table top, above the lidar
    cv2.imwrite(str(folder / "flat.pgm"), image)
    path = folder / "flat.yaml"
    path.write_text(yaml)
    return path


def test_row_zero_is_the_south_and_only_black_is_seen_by_the_lidar(tmp_path: Path) -> None:
    grid = load_map(write(tmp_path))
    assert grid.blocked.shape == (4, 6)
    assert np.argwhere(grid.blocked).tolist() == [[0, 4], [0, 5], [3, 0]]
    assert grid.seen_by_lidar is not None
    assert np.argwhere(grid.seen_by_lidar).tolist() == [[3, 0]]


def test_cells_and_world_points_agree(tmp_path: Path) -> None:
    grid = load_map(write(tmp_path))
    assert grid.world_to_cell(-1.0, -2.0) == (0, 0)
    assert grid.world_to_cell(-0.45, -1.75) == (2, 5)
    assert grid.world_to_cell(-1.01, -2.01) == (-1, -1)
    assert grid.cell_to_world(2, 5) == pytest.approx((-0.45, -1.75))
    for cell in [(0, 0), (3, 5), (-4, 9)]:
        assert grid.world_to_cell(*grid.cell_to_world(*cell)) == cell


def test_a_missing_file_is_told(tmp_path: Path) -> None:
    with pytest.raises(MapInvalid, match="nowhere"):
        load_map(tmp_path / "nowhere.yaml")


def test_a_path_goes_around_a_keep_out_zone() -> None:
    open_room = GridMap(
        resolution_m=0.1, origin_m=(0.0, 0.0), blocked=np.zeros((60, 60), dtype=bool)
    )
    path = PathPlanner(with_zones(open_room, [ZONE]), 0.2).plan((1.0, 2.0), (4.0, 2.0))
    assert not open_room.blocked.any()
    for a, b in pairwise(path):
        for s in np.linspace(0, 1, 50):
            x, y = a + (b - a) * s
            assert not (1.9 < x < 3.1 and 0.9 < y < 4.1)
