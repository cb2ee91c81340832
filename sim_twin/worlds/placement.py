"""Read a world's description and draw where its objects lie: the same seed, the same poses."""

from collections.abc import Mapping
from dataclasses import dataclass
from math import hypot
from pathlib import Path
from typing import Any

import numpy as np

from vla_deploy.runtime.table_schema import parse_toml

WORLDS_DIR = Path(__file__).parent
MAX_DRAWS = 1000


@dataclass(frozen=True, slots=True, kw_only=True)
class BodyPose:
    """Place an upright body: its origin and its turn about the vertical."""

    position_m: tuple[float, float, float]
    yaw_rad: float


@dataclass(frozen=True, slots=True, kw_only=True)
class WorldObject:
    """Describe one free object and the region in which it may lie."""

    name: str
    class_name: str
    colour: str
    surface: str
    rest_height_m: float
    x_m: tuple[float, float]
    y_m: tuple[float, float]
    yaw_rad: tuple[float, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class WorldSpec:
    """Describe a world: its MJCF, its surfaces and the objects in the order of drawing.

    `mount` is where the base of a robot that does not drive is screwed down, if there is a place.
    """

    name: str
    mjcf_path: Path
    min_distance_m: float
    surfaces: Mapping[str, float]
    objects: Mapping[str, WorldObject]
    mount: BodyPose | None = None


def load_world(name: str) -> WorldSpec:
    """Return the world of that name.

    Raises:
        FileNotFoundError: there is no such world; the message lists those there are.
    """
    file = WORLDS_DIR / f"{name}.toml"
    if not file.is_file():
        known = ", ".join(sorted(path.stem for path in WORLDS_DIR.glob("*.toml")))
        raise FileNotFoundError(f"no world {name!r} under {WORLDS_DIR}; there is {known}")
    document = parse_toml(file.read_text(encoding="utf-8"))
    return WorldSpec(
        name=document["name"],
        mjcf_path=WORLDS_DIR / document["mjcf"],
        min_distance_m=document["min_distance_m"],
        surfaces=document["surfaces"],
        objects={name: _object(name, row) for name, row in document["objects"].items()},
        mount=_mount(document["mount"]) if "mount" in document else None,
    )


def _mount(row: Mapping[str, Any]) -> BodyPose:
    x_m, y_m, z_m = row["position_m"]
    return BodyPose(position_m=(x_m, y_m, z_m), yaw_rad=row["yaw_rad"])


def _object(name: str, row: Mapping[str, Any]) -> WorldObject:
    return WorldObject(
        name=name,
        class_name=row["class"],
        colour=row["colour"],
        surface=row["surface"],
        rest_height_m=row["rest_height_m"],
        x_m=(row["x_m"][0], row["x_m"][1]),
        y_m=(row["y_m"][0], row["y_m"][1]),
        yaw_rad=(row["yaw_rad"][0], row["yaw_rad"][1]),
    )


def draw_poses(world: str, seed: int) -> dict[str, BodyPose]:
    """Return a pose for each object, no two nearer to each other than the world allows.

    Raises:
        FileNotFoundError: there is no such world.
        ValueError: the regions are too small for the objects and the distance between them.
    """
    spec = load_world(world)
    random = np.random.default_rng(seed)
    poses: dict[str, BodyPose] = {}
    for item in spec.objects.values():
        poses[item.name] = _draw_free(spec, item, poses, random)
    return poses


def _draw_free(
    world: WorldSpec,
    item: WorldObject,
    taken: Mapping[str, BodyPose],
    random: np.random.Generator,
) -> BodyPose:
    z_m = world.surfaces[item.surface] + item.rest_height_m
    for _ in range(MAX_DRAWS):
        x_m, y_m, yaw_rad = (
            float(random.uniform(*span)) for span in (item.x_m, item.y_m, item.yaw_rad)
        )
        gaps = (
            hypot(x_m - other.position_m[0], y_m - other.position_m[1]) for other in taken.values()
        )
        if all(gap >= world.min_distance_m for gap in gaps):
            return BodyPose(position_m=(x_m, y_m, z_m), yaw_rad=yaw_rad)
    raise ValueError(
        f"{world.name}: no room for {item.name} on {item.surface} after {MAX_DRAWS} draws; "
        f"widen its region or lower min_distance_m ({world.min_distance_m} m)"
    )
