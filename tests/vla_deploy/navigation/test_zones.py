from itertools import pairwise

import numpy as np

from vla_deploy.navigation.maps.zones import with_zones
from vla_deploy.navigation.path_planning import PathPlanner
from vla_deploy.robots.description import KeepOutZone
from vla_deploy.robots.maps.grid_map import GridMap

ZONE = KeepOutZone(
    name="stairs", reason="a drop", polygon_m=((2.0, 1.0), (3.0, 1.0), (3.0, 4.0), (2.0, 4.0))
)


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
