"""Give everything in an image its colours and light."""

from training.detector.scenes.layout import ImageContents
from training.detector.scenes.looks import colour_of, light_up, paint, shade_inner
from training.detector.scenes.parts import Random, between
from training.detector.scenes.scene_model import TEXTURES, Prop, SceneStage

FLAT_RECOLOURED_CHANCE = 0.6
FLAT_LIGHT_CHANCE = 0.6
OWN_TINTED_CHANCE = 0.35
FLAT_PAINT_SHARE = 0.6


def dress(stage: SceneStage, layout: ImageContents, random: Random) -> None:
    """Draw looks for what is shown, and the lights."""
    textures = [stage.model.texture(f"texture{number}").id for number in range(TEXTURES)]
    furniture = [*stage.tables, *([stage.walls] if stage.walls else [])]
    for prop in [*layout.shown, *furniture]:
        _dress_prop(stage, prop, textures, random)
    if stage.floor_material >= 0:
        paint(stage.model, stage.floor_material, "floor", textures, random)
    if not stage.surfaces:
        light_up(stage.model, stage.split, random)
        return
    _dress_flat(stage, textures, random)


def _dress_prop(stage: SceneStage, prop: Prop, textures: list[int], random: Random) -> None:
    for role, material in prop.materials.items():
        if role != "inner":
            paint(stage.model, material, role, textures, random)
    if "inner" in prop.materials:
        shade_inner(stage.model, prop.materials["inner"], prop.materials["main"], random)


def _dress_flat(stage: SceneStage, textures: list[int], random: Random) -> None:
    """Leave the flat as it is, tint it, or paint it anew."""
    model = stage.model
    if stage.split == "flat":
        return
    if random.random() < FLAT_RECOLOURED_CHANCE or stage.split == "heldout":
        for material in stage.own_materials:
            if random.random() < FLAT_PAINT_SHARE:
                paint(
                    model, material, "wall" if random.random() < 0.5 else "wood", textures, random
                )
                if random.random() < OWN_TINTED_CHANCE:
                    model.mat_rgba[material, :3] = colour_of("main", random)
    if random.random() < FLAT_LIGHT_CHANCE or stage.split == "heldout":
        gain = between(random, 0.5, 1.15)
        model.vis.headlight.ambient[:] *= gain * random.uniform(0.8, 1.0, 3)
        model.vis.headlight.diffuse[:] *= gain * random.uniform(0.7, 1.2, 3)
        model.light_diffuse[:] *= random.uniform(0.2, 1.4, (model.nlight, 1))
