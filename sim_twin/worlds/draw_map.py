"""Draw the ROS-format occupancy map of a world: `python -m sim_twin.worlds.draw_map`.

Two shades count as occupied: black is what the lidar sees, dark grey only what the robot's body
would hit (table tops, counters, low things). Localisation trusts black, navigation avoids both.
"""

import argparse
from pathlib import Path

import mujoco
import numpy as np
from numpy.typing import NDArray

from sim_twin.worlds.placement import load_world

RESOLUTION_M = 0.05
MARGIN_M = 0.25
LIDAR_HEIGHT_M = 0.19
BODY_HEIGHTS_M = (0.03, 1.25)
FREE, BODY_ONLY, SEEN = 254, 60, 0

Extent = tuple[float, float, float, float]
Image = NDArray[np.uint8]


def draw_map(model: mujoco.MjModel, extent: Extent) -> Image:
    """Return the map of a model's immovable geoms over (x_min, y_min, x_max, y_max), north up."""
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    x_min, y_min, x_max, y_max = extent
    columns = round((x_max - x_min) / RESOLUTION_M)
    image_rows = round((y_max - y_min) / RESOLUTION_M)
    x = x_min + (np.arange(columns) + 0.5) * RESOLUTION_M
    y = y_max - (np.arange(image_rows) + 0.5) * RESOLUTION_M
    grid_x, grid_y = np.meshgrid(x, y)
    image = np.full(grid_x.shape, FREE, dtype=np.uint8)
    for geom in range(model.ngeom):
        if not _is_obstacle(model, geom):
            continue
        bottom, top = _height_span(model, data, geom)
        covered = _covers(model, data, geom, grid_x, grid_y)
        if bottom <= LIDAR_HEIGHT_M <= top:
            image[covered] = SEEN
        elif bottom < BODY_HEIGHTS_M[1] and top > BODY_HEIGHTS_M[0]:
            image[covered & (image != SEEN)] = BODY_ONLY
    return image


def _is_obstacle(model: mujoco.MjModel, geom: int) -> bool:
    collides = bool(model.geom_contype[geom] or model.geom_conaffinity[geom])
    body = model.geom_bodyid[geom]
    immovable = model.body_weldid[body] == 0 and model.body_mocapid[body] < 0
    return collides and immovable and model.geom_type[geom] != mujoco.mjtGeom.mjGEOM_PLANE


def footprints_m(
    model: mujoco.MjModel, data: mujoco.MjData
) -> list[tuple[tuple[float, float], ...]]:
    """Return the corners, in the map, of the boxes that stand fast: walls and furniture."""
    found = []
    for geom in range(model.ngeom):
        if _is_obstacle(model, geom) and model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_BOX:
            half = _half_sizes(model, geom)
            corners = np.array(((-1, -1), (1, -1), (1, 1), (-1, 1))) * half[:2]
            turned = corners @ data.geom_xmat[geom].reshape(3, 3)[:2, :2].T
            at = turned + data.geom_xpos[geom, :2]
            found.append(tuple((round(float(x), 2), round(float(y), 2)) for x, y in at))
    return found


def _height_span(model: mujoco.MjModel, data: mujoco.MjData, geom: int) -> tuple[float, float]:
    half = float(_half_sizes(model, geom)[2])
    z = float(data.geom_xpos[geom, 2])
    return z - half, z + half


def _half_sizes(model: mujoco.MjModel, geom: int) -> NDArray[np.float64]:
    # The geom's own bounding box; exact for boxes and upright cylinders, generous for the rest.
    return np.asarray(model.geom_aabb[geom, 3:], dtype=np.float64)


def _covers(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    geom: int,
    grid_x: NDArray[np.float64],
    grid_y: NDArray[np.float64],
) -> NDArray[np.bool_]:
    half = _half_sizes(model, geom)
    axes = data.geom_xmat[geom].reshape(3, 3)
    dx, dy = grid_x - data.geom_xpos[geom, 0], grid_y - data.geom_xpos[geom, 1]
    # A thing thinner than a cell still fills the cell its middle lies in.
    reach = np.maximum(half[:2], RESOLUTION_M / 2)
    along, across = dx * axes[0, 0] + dy * axes[1, 0], dx * axes[0, 1] + dy * axes[1, 1]
    if model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_BOX:
        return np.asarray((np.abs(along) <= reach[0]) & (np.abs(across) <= reach[1]))
    return np.asarray(np.hypot(dx, dy) <= reach[0])


def floor_extent(model: mujoco.MjModel) -> Extent:
    """Return the rectangle around all immovable geoms, with a margin, on whole cells."""
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    geoms = [geom for geom in range(model.ngeom) if _is_obstacle(model, geom)]
    centres = data.geom_xpos[geoms, :2]
    halves = np.array([_half_sizes(model, geom)[:2] for geom in geoms])
    low = np.floor(((centres - halves).min(axis=0) - MARGIN_M) / RESOLUTION_M) * RESOLUTION_M
    high = np.ceil(((centres + halves).max(axis=0) + MARGIN_M) / RESOLUTION_M) * RESOLUTION_M
    x_min, y_min, x_max, y_max = (round(float(v), 3) for v in (*low, *high))
    return x_min, y_min, x_max, y_max


def map_text(image_name: str, extent: Extent) -> str:
    """Return the YAML document that ROS map servers read beside the image."""
    return (
        "# Drawn by `python -m sim_twin.worlds.draw_map`; do not edit.\n"
        f"# Pixels: {FREE} free, {SEEN} occupied where the lidar sees it, "
        f"{BODY_ONLY} occupied above or below the lidar.\n"
        f"image: {image_name}\n"
        f"resolution: {RESOLUTION_M}\n"
        f"origin: [{extent[0]}, {extent[1]}, 0.0]\n"
        "negate: 0\n"
        "occupied_thresh: 0.65\n"
        "free_thresh: 0.196\n"
        "mode: trinary\n"
    )


def write_map(world: str, folder: Path) -> Path:
    """Write `<world>.pgm` and `<world>.yaml` into a folder and return the latter's path."""
    model = mujoco.MjModel.from_xml_path(str(load_world(world).mjcf_path))
    extent = floor_extent(model)
    image = draw_map(model, extent)
    header = f"P5\n{image.shape[1]} {image.shape[0]}\n255\n".encode("ascii")
    (folder / f"{world}.pgm").write_bytes(header + image.tobytes())
    document = folder / f"{world}.yaml"
    document.write_text(map_text(f"{world}.pgm", extent), encoding="utf-8")
    return document


def main() -> None:
    """Draw the map of a world into a robot's folder."""
    parser = argparse.ArgumentParser(description=main.__doc__)
    parser.add_argument("--world", default="flat")
    parser.add_argument("--folder", type=Path, default=Path("vla_deploy/robots/butler/maps"))
    arguments = parser.parse_args()
    write_map(arguments.world, arguments.folder)


if __name__ == "__main__":
    main()
