"""Arrange a scene in front of the robot's camera: where it stands, what lies where."""

import math
from dataclasses import dataclass, field

import numpy as np

from training.detector.classes import CLUTTER, LARGE, SMALL
from training.detector.scenes.parts import Quaternion, Random, RestPose, about_z, between, product
from training.detector.scenes.scene_model import Prop, SceneStage
from training.detector.scenes.surfaces import CameraViewpoint, SceneSurface

CAMERA_HEIGHT_M = 1.2
FLAT_SIZE_M = (8.0, 6.0)
TRIES = 12
CONTENT_CHANCE, STACK_CHANCE, FLOOR_CHANCE = 0.45, 0.3, 0.15
LARGE_CHANCE = {"person": 0.5, "chair": 0.5}
ROOM_CHANCE = 0.2
"""Chance of a look around the room rather than at a table."""


@dataclass(slots=True, kw_only=True)
class Placed:
    """Keep the room that one thing takes."""

    x_m: float
    y_m: float
    z_m: float
    radius_m: float


@dataclass(slots=True, kw_only=True)
class ImageContents:
    """Collect what an image shows."""

    view: CameraViewpoint
    surfaces: tuple[SceneSurface, ...]
    shown: list[Prop] = field(default_factory=list)
    taken: list[Placed] = field(default_factory=list)


def arrange(stage: SceneStage, random: Random) -> ImageContents:
    """Show a random selection of things in front of the robot and return what is shown."""
    layout = _in_flat(stage, random) if stage.surfaces else _in_studio(stage, random)
    _put_large(stage, layout, random)
    _put_small(stage, layout, random)
    return layout


def _in_studio(stage: SceneStage, random: Random) -> ImageContents:
    """Stand tables in front of the robot, which is at the origin, and walls behind them."""
    surfaces: list[SceneSurface] = []
    far, around = 0.0, random.random() < ROOM_CHANCE
    for table in stage.tables[: int(random.integers(1, len(stage.tables) + 1))]:
        half_x, half_y = table.thing.extra["half_depth_m"], table.thing.extra["half_width_m"]
        first = between(random, 1.0, 2.2) if around else between(random, 0.28, 0.65)
        near = far + between(random, 0.1, 0.8) if surfaces else first
        side = between(random, -0.35, 0.35) if not surfaces else between(random, -1.2, 1.2)
        yaw = between(random, -0.25, 0.25)
        surface = SceneSurface(
            x_m=near + half_x, y_m=side, yaw_rad=yaw, half_x_m=half_x, half_y_m=half_y,
            height_m=between(random, 0.3, 0.92),
        )  # fmt: skip
        far = near + 2 * half_x
        surfaces.append(surface)
        stage.show(table, (surface.x_m, side, surface.height_m), about_z(yaw))
    assert stage.walls is not None
    stage.show(
        stage.walls,
        (far + between(random, 0.3, 3.0), 0.0, 0.0),
        about_z(between(random, -0.4, 0.4)),
    )
    at = surfaces[0]
    height_m = between(random, 0.2, 1.2) if around else at.height_m
    target = (*at.point(random, 0.05), height_m)
    view = CameraViewpoint(x_m=0.0, y_m=0.0, yaw_rad=between(random, -0.15, 0.15), target=target)
    return ImageContents(view=view, surfaces=tuple(surfaces))


def _in_flat(stage: SceneStage, random: Random) -> ImageContents:
    """Stand the robot at one side of a table of the flat, or anywhere in it, looking around."""
    if random.random() < 0.2:
        return ImageContents(view=_anywhere(random), surfaces=stage.surfaces)
    for _ in range(10 * TRIES):
        surface = stage.surfaces[int(random.integers(len(stage.surfaces)))]
        target = surface.point(random, 0.05)
        angle = float(random.choice([0.0, 0.5, 1.0, 1.5])) * math.pi + between(random, -0.4, 0.4)
        reach = (surface.half_x_m, surface.half_y_m)[abs(math.sin(angle)) > 0.7]
        away = reach + between(random, 0.28, 1.0)
        x, y = target[0] + away * math.cos(angle), target[1] + away * math.sin(angle)
        inside = all(
            0.3 < value < size - 0.3 for value, size in zip((x, y), FLAT_SIZE_M, strict=True)
        )
        if inside and not any(other.covers(x, y, 0.2) for other in stage.surfaces):
            yaw = angle + math.pi + between(random, -0.2, 0.2)
            view = CameraViewpoint(x_m=x, y_m=y, yaw_rad=yaw, target=(*target, surface.height_m))
            return ImageContents(view=view, surfaces=stage.surfaces)
    return ImageContents(view=_anywhere(random), surfaces=stage.surfaces)


def _anywhere(random: Random) -> CameraViewpoint:
    x, y, yaw = between(random, 0.6, 7.0), between(random, 0.9, 5.4), between(random, -3.14, 3.14)
    far = between(random, 0.8, 3.0)
    target = (x + far * math.cos(yaw), y + far * math.sin(yaw), between(random, 0.0, 0.9))
    return CameraViewpoint(x_m=x, y_m=y, yaw_rad=yaw, target=target)


def _put_large(stage: SceneStage, layout: ImageContents, random: Random) -> None:
    for name in LARGE:
        for prop in stage.props:
            if prop.thing.class_name == name and random.random() < LARGE_CHANCE[name] / 2:
                _put_on_floor(stage, layout, prop, (0.75, 3.6), random)


def _put_small(stage: SceneStage, layout: ImageContents, random: Random) -> None:
    pool = [prop for prop in stage.props if prop.thing.class_name in SMALL]
    order = [pool[int(k)] for k in random.permutation(len(pool))]
    wanted = int(random.integers(3, 13))
    noise = [prop for prop in stage.props if prop.thing.class_name == CLUTTER]
    picks = random.permutation(len(noise))[: int(random.integers(0, 5))]
    for prop in [*order[:wanted], *(noise[int(k)] for k in picks)]:
        if prop in layout.shown:
            continue
        if random.random() < FLOOR_CHANCE:
            _put_on_floor(stage, layout, prop, (0.45, 2.4), random)
        else:
            _put_on_surface(stage, layout, prop, order, random)


def _put_on_floor(
    stage: SceneStage,
    layout: ImageContents,
    prop: Prop,
    reach_m: tuple[float, float],
    random: Random,
) -> None:
    for _ in range(TRIES):
        forward = between(random, *reach_m)
        x, y = layout.view.ahead(forward, forward * between(random, -0.65, 0.65))
        margin = 0.7 * prop.thing.radius_m
        if not any(s.covers(x, y, margin) for s in layout.surfaces) and _free(
            layout, prop, x, y, 0.0
        ):
            _show(stage, layout, prop, (x, y, 0.0), _draw_rest(prop, random), random)
            return


def _put_on_surface(
    stage: SceneStage, layout: ImageContents, prop: Prop, others: list[Prop], random: Random
) -> None:
    surface = _surface_in_view(layout, random)
    for _ in range(TRIES):
        x, y = surface.point(random, min(0.6 * prop.thing.radius_m, 0.1))
        if math.dist((x, y), layout.view.target[:2]) > 0.7 * random.random() + 0.25:
            continue
        if _free(layout, prop, x, y, surface.height_m):
            rest = _draw_rest(prop, random)
            _show(stage, layout, prop, (x, y, surface.height_m), rest, random)
            if rest is prop.thing.rests[0]:
                _add_content(stage, layout, prop, (x, y, surface.height_m), others, random)
            return


def _surface_in_view(layout: ImageContents, random: Random) -> SceneSurface:
    """Return mostly the surface that is looked at."""
    x, y = layout.view.target[:2]
    at = [s for s in layout.surfaces if s.covers(x, y, 0.0)] or list(layout.surfaces)
    pool = at if random.random() < 0.8 else layout.surfaces
    return pool[int(random.integers(len(pool)))]


def _add_content(
    stage: SceneStage,
    layout: ImageContents,
    holder: Prop,
    at: tuple[float, float, float],
    others: list[Prop],
    random: Random,
) -> None:
    """Put something smaller into a container or onto a book, sometimes."""
    thing = holder.thing
    if thing.inside is not None and random.random() < CONTENT_CHANCE:
        radius_m, height_m = thing.inside
    elif thing.top_m is not None and random.random() < STACK_CHANCE:
        radius_m, height_m = thing.radius_m, thing.top_m
    else:
        return
    for prop in others:
        if prop not in layout.shown and prop.thing.radius_m < radius_m:
            slack = 0.7 * (radius_m - prop.thing.radius_m)
            x, y = at[0] + between(random, -slack, slack), at[1] + between(random, -slack, slack)
            _show(stage, layout, prop, (x, y, at[2] + height_m), _draw_rest(prop, random), random)
            return


def _free(layout: ImageContents, prop: Prop, x: float, y: float, z: float) -> bool:
    return all(
        abs(other.z_m - z) > 0.2
        or math.hypot(other.x_m - x, other.y_m - y) > 0.85 * (other.radius_m + prop.thing.radius_m)
        for other in layout.taken
    )


def _draw_rest(prop: Prop, random: Random) -> RestPose:
    rests = prop.thing.rests
    weights = np.array([rest.weight for rest in rests])
    return rests[int(random.choice(len(rests), p=weights / weights.sum()))]


def _show(
    stage: SceneStage,
    layout: ImageContents,
    prop: Prop,
    at: tuple[float, float, float],
    rest: RestPose,
    random: Random,
) -> None:
    turn: Quaternion = product(about_z(between(random, -math.pi, math.pi)), rest.quat)
    stage.show(prop, (at[0], at[1], at[2] + rest.height_m), turn)
    layout.shown.append(prop)
    layout.taken.append(Placed(x_m=at[0], y_m=at[1], z_m=at[2], radius_m=prop.thing.radius_m))
