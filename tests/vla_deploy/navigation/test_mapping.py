"""A map that is drawn on the way, against the solids that the scans were traced on."""

import math
from typing import TYPE_CHECKING

import numpy as np
import pytest

from vla_deploy.navigation.localising.scan import ScanPoints
from vla_deploy.navigation.maps.mapping import Mapper
from vla_deploy.navigation.maps.occupancy import OccupancyGrid
from vla_deploy.robots.errors import MapInvalid
from vla_deploy.robots.floor_pose import ORIGIN, Pose2D
from vla_deploy.robots.maps.map_file import (
    FREE_SHADE,
    LOW_SHADE,
    OCCUPIED_SHADE,
    UNKNOWN_SHADE,
    MapFile,
)

if TYPE_CHECKING:
    from conftest import TracedFlat

START = Pose2D(1.5, 1.5, 0.0)


def toured(flat: "TracedFlat", *, wheels: float = 1.05) -> tuple[Mapper, Pose2D]:
    """Drive a circle with wheels that tell too much; return the mapper and the truth."""
    mapper, true, odometry, yaw_rad = Mapper(START), START, ORIGIN, 0.0
    mapper.predict(flat.now_ns, odometry, yaw_rad)
    for tick in range(200):
        true = true.compose(Pose2D(0.04, 0.0, 0.0)).compose(Pose2D(0.0, 0.0, 0.038))
        odometry = odometry.compose(Pose2D(0.04 * wheels, 0.0, 0.0)).compose(
            Pose2D(0.0, 0.0, 0.038)
        )
        yaw_rad += 0.038
        flat.now_ns += 100_000_000
        mapper.predict(flat.now_ns, odometry, math.remainder(yaw_rad, math.tau))
        mapper.add_scan(flat.scan(true, seed=tick), flat.stamps())
    return mapper, true


def at(file: MapFile, x_m: float, y_m: float) -> int:
    row = file.shades.shape[0] - 1 - math.floor((y_m - file.origin_m[1]) / file.resolution_m)
    return int(file.shades[row, math.floor((x_m - file.origin_m[0]) / file.resolution_m)])


def test_a_map_drawn_on_the_way_is_right_and_the_pose_does_not_drift(flat: "TracedFlat") -> None:
    mapper, true = toured(flat)
    assert mapper.pose.distance_m(true) < 0.03
    assert mapper.pose.turn_rad(true) < 0.02
    file, truth = mapper.grid.map_file(), flat.map()
    right = wrong = 0
    for row, column in np.ndindex(*truth.blocked.shape):
        x_m, y_m = truth.cell_to_world(row, column)
        inside = (x_m > file.origin_m[0]) & (y_m > file.origin_m[1])
        end_x = file.origin_m[0] + file.shades.shape[1] * file.resolution_m
        end_y = file.origin_m[1] + file.shades.shape[0] * file.resolution_m
        if not (inside and x_m < end_x and y_m < end_y):
            continue
        shade = at(file, x_m, y_m)
        if shade != UNKNOWN_SHADE:
            fits = (shade == OCCUPIED_SHADE) == bool(truth.blocked[row, column])
            right, wrong = right + fits, wrong + (not fits)
    assert right > 8_000
    assert right / (right + wrong) > 0.97


def test_a_beam_makes_its_way_free_and_its_end_occupied_and_leaves_the_rest_unknown() -> None:
    grid = OccupancyGrid(0.05)
    beams = 8
    scan = ScanPoints(
        np.zeros((beams, 2)), np.column_stack((np.full(beams, 2.0), np.linspace(0.0, 0.3, beams)))
    )
    for _ in range(4):
        grid.add_scan(scan)
    file = grid.map_file()
    assert at(file, 1.0, 0.08) == FREE_SHADE
    assert at(file, 2.02, 0.17) == OCCUPIED_SHADE
    assert (file.shades == UNKNOWN_SHADE).any()


def test_what_only_the_camera_sees_is_dark_grey_until_the_floor_is_seen_bare_there() -> None:
    mapper = Mapper()
    table = np.tile((1.02, 0.02), (3, 1))
    nothing = np.zeros((0, 2))
    mapper.add_depth(table, nothing, 0)
    assert at(mapper.grid.map_file(), 1.02, 0.02) == LOW_SHADE
    for _ in range(3):
        mapper.add_depth(nothing, table, 0)
    assert not (mapper.grid.map_file().shades == LOW_SHADE).any()


def test_the_map_grows_without_moving_what_it_holds() -> None:
    grid = OccupancyGrid(0.1)
    for x_m in (0.55, -9.45, 12.35):
        grid.add_depth(np.array([[x_m, -x_m]]), np.zeros((0, 2)))
    file = grid.map_file()
    for x_m in (0.55, -9.45, 12.35):
        assert at(file, x_m, -x_m) == LOW_SHADE
    assert np.count_nonzero(file.shades == LOW_SHADE) == 3


def test_poses_that_run_away_end_the_recording_with_a_reason() -> None:
    with pytest.raises(MapInvalid, match="poses must be wrong"):
        OccupancyGrid().add_depth(np.array([[1000.0, 0.0], [0.0, 0.0]]), np.zeros((0, 2)))


def test_scans_that_tell_nothing_or_contradict_the_map_are_refused(flat: "TracedFlat") -> None:
    mapper, _ = toured(flat)
    before, scans = mapper.grid.map_file(), mapper.scans
    for ranges in (np.zeros(360), np.full(360, np.nan), np.full(360, 0.5)):
        assert not mapper.add_scan(ranges.astype(np.float32), flat.stamps())
    assert mapper.scans == scans
    assert mapper.refused >= 3
    assert np.array_equal(mapper.grid.map_file().shades, before.shades)


def test_an_empty_map_can_be_written() -> None:
    file = OccupancyGrid().map_file()
    assert file.shades.tolist() == [[UNKNOWN_SHADE]]
