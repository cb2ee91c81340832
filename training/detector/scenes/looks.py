"""Draw colours, materials and lights: one table says how each role of a part looks."""

import colorsys
import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from training.detector.scenes.parts import Random, between

Colour = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class RoleLook:
    """Bound a role's hue, saturation and value, and the chances of a texture and of glass."""

    hue: tuple[float, float]
    saturation: tuple[float, float]
    value: tuple[float, float]
    texture_chance: float = 0.0
    glass_chance: float = 0.0
    shine: float = 0.4


LOOKS: dict[str, RoleLook] = {
    "main": RoleLook((0, 1), (0, 1), (0.03, 1), 0.22, 0.0, 0.6),
    "accent": RoleLook((0, 1), (0, 1), (0.05, 1), 0.1),
    "label": RoleLook((0, 1), (0, 0.8), (0.3, 1), 0.5),
    "paper": RoleLook((0.08, 0.16), (0, 0.25), (0.75, 1)),
    "metal": RoleLook((0.08, 0.16), (0, 0.6), (0.35, 0.95), 0.0, 0.0, 1.0),
    "dark": RoleLook((0, 1), (0, 0.5), (0, 0.25)),
    "screen": RoleLook((0.5, 0.75), (0, 0.7), (0.0, 0.25), 0.06, 0.0, 1.0),
    "shell": RoleLook((0, 1), (0, 0.6), (0, 0.9), 0.03),
    "buttons": RoleLook((0, 1), (0, 0.5), (0.2, 1)),
    "skin": RoleLook((0.02, 0.1), (0.2, 0.65), (0.25, 1), 0.0, 0.0, 0.1),
    "hair": RoleLook((0.02, 0.14), (0, 0.7), (0, 0.8), 0.1, 0.0, 0.1),
    "trousers": RoleLook((0, 1), (0, 0.8), (0, 0.8), 0.25, 0.0, 0.0),
    "seat": RoleLook((0, 1), (0, 0.9), (0.05, 1), 0.3, 0.0, 0.2),
    "leaf": RoleLook((0.2, 0.45), (0.2, 0.9), (0.15, 0.9), 0.1),
    "wood": RoleLook((0.04, 0.14), (0, 0.7), (0.2, 1), 0.4),
    "wall": RoleLook((0, 1), (0, 0.35), (0.35, 1), 0.35, 0.0, 0.0),
    "floor": RoleLook((0, 1), (0, 0.6), (0.2, 1), 0.7, 0.0, 0.2),
}
NAMED_SHARE = 0.35
"""Share of parts that take one of the plain colours a person would name."""
NAMED: tuple[Colour, ...] = (
    (0.8, 0.06, 0.06), (0.08, 0.2, 0.82), (0.06, 0.5, 0.2), (0.95, 0.76, 0.05), (0.93, 0.5, 0.1),
    (0.5, 0.16, 0.58), (0.04, 0.04, 0.05), (0.95, 0.95, 0.93), (0.5, 0.5, 0.52), (0.45, 0.28, 0.15),
    (0.9, 0.5, 0.65),
)  # fmt: skip
FREE_ROLES = ("main", "accent", "seat", "shell")
SHELL_DARK_SHARE = 0.5


def colour_of(role: str, random: Random) -> Colour:
    """Return a colour for a role."""
    look = LOOKS[role]
    if role == "shell" and random.random() < SHELL_DARK_SHARE:
        return (between(random, 0, 0.15),) * 3
    if role in FREE_ROLES and random.random() < NAMED_SHARE:
        tint = random.uniform(0.85, 1.1, 3)
        named = NAMED[int(random.integers(len(NAMED)))]
        return tuple(float(min(1.0, c * t)) for c, t in zip(named, tint, strict=True))  # type: ignore[return-value]
    return colorsys.hsv_to_rgb(
        *(between(random, *span) for span in (look.hue, look.saturation, look.value))
    )


def paint(model: Any, material: int, role: str, textures: list[int], random: Random) -> None:
    """Give one material of the compiled model a new colour, texture and shine."""
    look = LOOKS[role]
    textured = random.random() < look.texture_chance
    model.mat_rgba[material] = (*colour_of(role, random), 1.0)
    model.mat_texid[material] = -1
    if textured:
        model.mat_texid[material, TEXTURE_ROLE] = textures[int(random.integers(len(textures)))]
        model.mat_rgba[material, :3] = 0.4 + 0.6 * model.mat_rgba[material, :3]
    model.mat_texrepeat[material] = between(random, 1, 12 if role == "floor" else 3)
    model.mat_specular[material] = between(random, 0, look.shine)
    model.mat_shininess[material] = between(random, 0, 1)
    model.mat_emission[material] = 0.0


TEXTURE_ROLE = 1
"""MuJoCo's mjTEXROLE_RGB."""
INNER_SHADE = (0.4, 0.95)


def shade_inner(model: Any, inner: int, main: int, random: Random) -> None:
    """Give the inside of a container a darker shade of its outside."""
    model.mat_rgba[inner, :3] = model.mat_rgba[main, :3] * between(random, *INNER_SHADE)
    model.mat_texid[inner] = -1


def light_up(model: Any, split: str, random: Random) -> None:
    """Draw the lights: training has soft rooms, judging also single hard and coloured lamps."""
    hard = split == "heldout" and random.random() < 0.5
    ambient = between(random, 0.15, 0.3) if hard else between(random, 0.3, 0.6)
    head = between(random, 0.0, 0.25) if hard else between(random, 0.15, 0.5)
    model.vis.headlight.ambient[:] = ambient * _tint(random, 0.1)
    model.vis.headlight.diffuse[:] = head * _tint(random, 0.1)
    lit = 1 if hard else int(random.integers(1, model.nlight + 1))
    for light in range(model.nlight):
        model.light_active[light] = light < lit
        power = between(random, 0.5, 0.9) if hard else between(random, 0.1, 0.5)
        model.light_diffuse[light] = power * _tint(random, 0.35 if hard else 0.15)
        model.light_specular[light] = between(random, 0, 0.4)
        _aim(model, light, hard, random)


def _tint(random: Random, spread: float) -> np.ndarray:
    return np.asarray(random.uniform(1.0 - spread, 1.0, 3))


def _aim(model: Any, light: int, low: bool, random: Random) -> None:
    angle, far = between(random, 0, 2 * math.pi), between(random, 0.3, 3.0)
    height = between(random, 0.9, 1.6) if low else between(random, 1.6, 3.2)
    position = np.array([1.0 + far * math.cos(angle), far * math.sin(angle), height])
    aim = np.array([1.0, 0.0, 0.4]) + random.uniform(-0.5, 0.5, 3) - position
    model.light_pos[light] = position
    model.light_dir[light] = aim / np.linalg.norm(aim)
