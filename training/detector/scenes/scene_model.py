"""Compile a stage: one pool of things, furniture and clutter, of which each image shows some."""

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from sim_twin.physics.compose import ROBOT_LOOKS_GROUP
from training.detector.scenes import clutter, figures, things
from training.detector.scenes.parts import (
    UPRIGHT,
    Quaternion,
    Random,
    RestPose,
    SceneThing,
    SolidPart,
    Vector,
    between,
)
from training.detector.scenes.surfaces import SceneSurface
from training.detector.scenes.textures import SIZE_PX, draw_texture
from vla_deploy.robots.loader import ROBOTS_DIR

ROBOT_PREFIX = "butler_"
COPIES = 2
CLUTTER_COUNT = 9
TEXTURES = 14
TABLES = 3
LIGHTS = 3
VARIED = (
    "mat_rgba", "mat_texid", "mat_texrepeat", "mat_specular", "mat_shininess", "mat_emission",
    "light_active", "light_diffuse", "light_specular", "light_pos", "light_dir",
    "cam_pos", "cam_quat", "cam_fovy",
)  # fmt: skip
HIDDEN_GROUP = 5
SHOWN_GROUP = 1
_GEOM = {
    "box": mujoco.mjtGeom.mjGEOM_BOX,
    "cylinder": mujoco.mjtGeom.mjGEOM_CYLINDER,
    "sphere": mujoco.mjtGeom.mjGEOM_SPHERE,
    "capsule": mujoco.mjtGeom.mjGEOM_CAPSULE,
    "ellipsoid": mujoco.mjtGeom.mjGEOM_ELLIPSOID,
    "mesh": mujoco.mjtGeom.mjGEOM_MESH,
}


@dataclass(slots=True, kw_only=True, eq=False)
class Prop:
    """Hold a thing of the compiled model: a mocap body, or a free one at `qpos`."""

    thing: SceneThing
    geoms: list[int]
    materials: dict[str, int]
    mocap: int = -1
    qpos: int = -1


@dataclass(slots=True, kw_only=True, eq=False)
class SceneStage:
    """Hold a compiled model and what can be shown in it.

    `fixed` are labelled parts of the building; `own_materials` those that the building came with.
    """

    model: Any
    data: Any
    split: str
    props: list[Prop]
    tables: list[Prop] = field(default_factory=list)
    walls: Prop | None = None
    floor_material: int = -1
    fixed: list[tuple[str, list[int]]] = field(default_factory=list)
    surfaces: tuple[SceneSurface, ...] = ()
    own_materials: list[int] = field(default_factory=list)
    first: dict[str, NDArray[np.float64]] = field(default_factory=dict)

    def remember(self) -> None:
        """Keep what is varied from image to image as it is now."""
        for name in VARIED:
            self.first[name] = np.array(getattr(self.model, name))
        self.first["ambient"] = np.array(self.model.vis.headlight.ambient)
        self.first["diffuse"] = np.array(self.model.vis.headlight.diffuse)

    def restore(self) -> None:
        """Hide everything and undo what was varied."""
        for name in VARIED:
            getattr(self.model, name)[:] = self.first[name]
        self.model.vis.headlight.ambient[:] = self.first["ambient"]
        self.model.vis.headlight.diffuse[:] = self.first["diffuse"]
        for prop in [*self.props, *self.tables, *([self.walls] if self.walls else [])]:
            self.model.geom_group[prop.geoms] = HIDDEN_GROUP

    def show(self, prop: Prop, at: Vector, quat: Quaternion) -> None:
        """Put a thing somewhere and make it visible."""
        self.model.geom_group[prop.geoms] = SHOWN_GROUP
        if prop.mocap >= 0:
            self.data.mocap_pos[prop.mocap], self.data.mocap_quat[prop.mocap] = at, quat
        else:
            self.data.qpos[prop.qpos : prop.qpos + 7] = (*at, *quat)


def build_studio(random: Random, split: str) -> SceneStage:
    """Compile a bare room with tables and newly drawn things; the robot stands in its middle."""
    spec = mujoco.MjSpec()
    spec.compiler.degree = False
    _room(spec)
    tables = [_table(random) for _ in range(TABLES)]
    stage = complete(spec, random, split, (*tables, _walls()))
    stage.floor_material = stage.model.material("floor").id
    stage.remember()
    return stage


def complete(
    spec: Any, random: Random, split: str, furniture: tuple[SceneThing, ...] = ()
) -> SceneStage:
    """Add textures, the robot, furniture (its last piece the walls) and a pool of things."""
    for number in range(TEXTURES):
        _texture(spec, f"texture{number}", draw_texture(random, split))
    _robot(spec)
    drawn = _draw_things(random)
    every = [*drawn, *furniture]
    for number, thing in enumerate(every):
        _add(spec, f"thing{number}", thing)
    model = spec.compile()
    props = [_find(model, f"thing{number}", thing) for number, thing in enumerate(every)]
    fixtures = props[len(drawn) :]
    return SceneStage(
        model=model,
        data=mujoco.MjData(model),
        split=split,
        props=props[: len(drawn)],
        tables=fixtures[:-1],
        walls=fixtures[-1] if fixtures else None,
    )


def _draw_things(random: Random) -> list[SceneThing]:
    drawn = [build(random) for build in things.BUILDERS.values() for _ in range(COPIES)]
    drawn += [build(random) for build in figures.BUILDERS.values() for _ in range(COPIES)]
    picks = random.integers(len(clutter.BUILDERS), size=CLUTTER_COUNT)
    return drawn + [clutter.BUILDERS[int(pick)](random) for pick in picks]


def _room(spec: Any) -> None:
    spec.visual.quality.shadowsize = 0
    spec.visual.quality.offsamples = 0
    spec.visual.quality.numstacks = 8
    spec.visual.quality.numslices = 16
    spec.visual.map.znear = 0.004
    spec.visual.map.zfar = 10.0
    spec.stat.extent = 6.0
    spec.stat.center = [2.0, 0.0, 0.4]
    spec.add_material(name="floor")
    kind = mujoco.mjtGeom.mjGEOM_PLANE
    spec.worldbody.add_geom(type=kind, size=[12, 12, 0.1], material="floor", group=SHOWN_GROUP)
    for _ in range(LIGHTS):
        spec.worldbody.add_light(pos=[0, 0, 3], dir=[0, 0, -1], castshadow=False)


def _texture(spec: Any, name: str, image: np.ndarray) -> None:
    texture = spec.add_texture(
        name=name,
        type=mujoco.mjtTexture.mjTEXTURE_CUBE,
        nchannel=3,
        width=SIZE_PX,
        height=SIZE_PX * 6,
    )
    texture.data = np.tile(image, (6, 1, 1)).tobytes()


def _robot(spec: Any) -> None:
    robot = mujoco.MjSpec.from_file(str(ROBOTS_DIR / "butler" / "butler.xml"))
    for geom in robot.geoms:
        geom.group = ROBOT_LOOKS_GROUP if geom.group <= ROBOT_LOOKS_GROUP else HIDDEN_GROUP
    spec.option.integrator = robot.option.integrator
    spec.option.cone = robot.option.cone
    spec.option.impratio = robot.option.impratio
    spec.attach(robot, prefix=ROBOT_PREFIX, frame=spec.worldbody.add_frame())


def _table(random: Random) -> SceneThing:
    """Return a table, shelf board or counter; its top is at height zero."""
    a, b = between(random, 0.15, 0.45), between(random, 0.25, 0.8)
    thick, leg = between(random, 0.01, 0.03), between(random, 0.015, 0.035)
    parts = [SolidPart(kind="box", size=(a, b, thick), at=(0, 0, -thick), role="wood")]
    if random.random() < 0.35:
        parts.append(
            SolidPart(
                kind="box", size=(a * 0.97, b * 0.97, 0.5), at=(0, 0, -0.5 - thick), role="seat"
            )
        )
    else:
        for x in (-1, 1):
            for y in (-1, 1):
                at = (x * (a - leg), y * (b - leg), -0.5 - thick)
                parts.append(SolidPart(kind="cylinder", size=(leg, 0.5, 0), at=at, role="seat"))
    extra = {"half_depth_m": a, "half_width_m": b}
    return SceneThing(
        class_name="table",
        parts=tuple(parts),
        rests=(RestPose(quat=UPRIGHT, height_m=0.0),),
        radius_m=max(a, b),
        extra=extra,
    )


def _walls() -> SceneThing:
    parts = [
        SolidPart(kind="box", size=(0.05, 6, 1.3), at=(0, 0, 1.3), role="wall"),
        SolidPart(kind="box", size=(6, 0.05, 1.3), at=(-3, 3, 1.3), role="wall"),
        SolidPart(kind="box", size=(0.06, 6, 0.04), at=(-0.01, 0, 0.04), role="paper"),
        SolidPart(kind="box", size=(0.06, 0.45, 1.0), at=(-0.01, 1.0, 1.0), role="wood"),
    ]
    return SceneThing(class_name="walls", parts=tuple(parts), rests=(), radius_m=6)


def _add(spec: Any, name: str, thing: SceneThing) -> None:
    body = spec.worldbody.add_body(name=name, mocap=True)
    for role in _roles(thing.parts):
        spec.add_material(name=f"{name}_{role}", texuniform=False)
    for number, part in enumerate(thing.parts):
        arguments: dict[str, Any] = {"size": list(part.size)}
        if part.mesh is not None:
            mesh = f"{name}_{number}"
            added = spec.add_mesh(name=mesh, inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL)
            added.uservert = part.mesh.vertices.ravel()
            added.userface = part.mesh.faces.ravel()
            arguments = {"meshname": mesh}
        body.add_geom(
            type=_GEOM[part.kind],
            pos=list(part.at),
            quat=list(part.quat),
            material=f"{name}_{part.role}",
            contype=0,
            conaffinity=0,
            group=HIDDEN_GROUP,
            **arguments,
        )


def _roles(parts: Iterable[SolidPart]) -> list[str]:
    return sorted({part.role for part in parts})


def _find(model: Any, name: str, thing: SceneThing) -> Prop:
    body = model.body(name).id
    first = int(model.body_geomadr[body])
    return Prop(
        thing=thing,
        mocap=int(model.body_mocapid[body]),
        geoms=list(range(first, first + int(model.body_geomnum[body]))),
        materials={role: model.material(f"{name}_{role}").id for role in _roles(thing.parts)},
    )
