from pathlib import Path

import mujoco
import numpy as np

from sim_twin.worlds.draw_map import BODY_ONLY, FREE, RESOLUTION_M, SEEN, draw_map, write_map
from vla_deploy.robots import load_robot
from vla_deploy.robots.floor_pose import Pose2D

ROOM = """
<mujoco>
  <worldbody>
    <geom type="plane" size="5 5 1"/>
    <geom type="box" size="0.05 0.5 0.5" pos="0.5 0 0.5"/>
    <geom type="box" size="0.2 0.1 0.02" pos="-0.4 0.4 0.5"/>
    <geom type="box" size="0.2 0.2 0.01" pos="-0.4 -0.4 0.01"/>
    <body pos="0 0 0.2"><freejoint/><geom type="sphere" size="0.1"/></body>
  </worldbody>
</mujoco>
"""


def test_walls_are_seen_table_tops_are_hit_rugs_and_loose_things_are_neither() -> None:
    image = draw_map(mujoco.MjModel.from_xml_string(ROOM), (-1.0, -1.0, 1.0, 1.0))

    def at(x_m: float, y_m: float) -> int:
        return int(image[int((1.0 - y_m) / RESOLUTION_M), int((x_m + 1.0) / RESOLUTION_M)])

    assert at(0.51, 0.01) == SEEN
    assert at(-0.41, 0.41) == BODY_ONLY
    assert at(-0.41, -0.41) == FREE
    assert at(0.01, 0.01) == FREE


def test_the_robots_map_is_the_one_that_the_world_gives(tmp_path: Path) -> None:
    kept = load_robot("butler").home.map_path

    drawn = write_map("flat", tmp_path)

    assert drawn.read_text() == kept.read_text()
    assert drawn.with_suffix(".pgm").read_bytes() == kept.with_suffix(".pgm").read_bytes()


def test_the_robot_has_room_at_every_place_and_viewpoint() -> None:
    robot = load_robot("butler")
    for place in robot.places.values():
        for pose in (place.pose, *place.viewpoints):
            assert clearance_m(robot.home.map_path, pose) > robot.base.footprint_radius_m, (
                place.name
            )


def clearance_m(document: Path, pose: Pose2D) -> float:
    origin = next(line for line in document.read_text().splitlines() if line.startswith("origin"))
    x_min, y_min = (float(v) for v in origin.split("[")[1].split(",")[:2])
    data = document.with_suffix(".pgm").read_bytes()
    _, size, _, pixels = data.split(b"\n", 3)
    width, height = map(int, size.split())
    image = np.frombuffer(pixels, dtype=np.uint8).reshape(height, width)
    rows, columns = np.nonzero(image != FREE)
    x_m = x_min + (columns + 0.5) * RESOLUTION_M
    y_m = y_min + (height - rows - 0.5) * RESOLUTION_M
    return float(np.hypot(x_m - pose.x_m, y_m - pose.y_m).min()) - RESOLUTION_M / 2
