"""Compute a body's mass, centre of mass and inertia from its MJCF, as MuJoCo's compiler does.

An `<inertial>` counts as it is; without one, the body's geoms are solid and of even density.
"""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from vla_deploy.robots.errors import RobotFileError
from vla_deploy.robots.kinematics.kinematic_tree import Vector
from vla_deploy.robots.kinematics.mjcf_document import BodyElement, Element, MjcfDocument
from vla_deploy.robots.kinematics.orientation import Attributes, matrix, numbers
from vla_deploy.runtime.table_schema import TableFault

Array = NDArray[np.float64]

_WATER: Final = "1000"
_ALL_GROUPS: Final = "0 5"
# Each changes every body's mass behind the file's numbers.
_REFUSED: Final[Mapping[str, str]] = {
    "settotalmass": "-1",
    "boundmass": "0",
    "boundinertia": "0",
    "balanceinertia": "false",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class LinkInertia:
    """Hold a mass, its centre in the link's frame, and its inertia about that centre.

    `tensor_kg_m2` is 3 x 3, along the axes of the link.
    """

    mass_kg: float
    centre_m: Array
    tensor_kg_m2: Array


def inertia_of(document: MjcfDocument, body: BodyElement) -> LinkInertia | None:
    """Return a body's inertia, or None for a body without mass.

    Raises:
        RobotFileError: the mass depends on a mesh or on a compiler option that is not supported.
    """
    _refuse_compiler_options(document)
    way = document.compiler.get("inertiafromgeom", "auto")
    inertial = body.element.find("inertial")
    if inertial is not None and way != "true":
        return _explicit(document, inertial)
    return None if way == "false" else _joined([*_of_geoms(document, body)])


def _refuse_compiler_options(document: MjcfDocument) -> None:
    for option, harmless in _REFUSED.items():
        got = document.compiler.get(option, harmless)
        is_harmless = got == harmless if harmless == "false" else float(got) <= float(harmless)
        if not is_harmless:
            expected = "no such option: write the masses into the bodies"
            _refuse(document, f"compiler.{option}", got, expected)


def _refuse(document: MjcfDocument, key: str, got: str, expected: str) -> None:
    fault = TableFault(key=key, got=got, expected=expected)
    raise RobotFileError(document.path, (fault,))


def _explicit(document: MjcfDocument, inertial: Element) -> LinkInertia:
    if "fullinertia" in inertial.attrib:
        xx, yy, zz, xy, xz, yz = numbers(inertial.attrib["fullinertia"])
        own = np.array(((xx, xy, xz), (xy, yy, yz), (xz, yz, zz)))
    else:
        own = np.diag(numbers(inertial.get("diaginertia", "0 0 0")))
    turned = matrix(document.turned(inertial.attrib))
    return LinkInertia(
        mass_kg=float(inertial.get("mass", "0")),
        centre_m=numbers(inertial.get("pos", "0 0 0")),
        tensor_kg_m2=turned @ own @ turned.T,
    )


def _joined(parts: Sequence[LinkInertia]) -> LinkInertia | None:
    mass = sum(part.mass_kg for part in parts)
    if mass <= 0.0:
        return None
    centre = sum((part.mass_kg * part.centre_m for part in parts), np.zeros(3)) / mass
    tensor = np.zeros((3, 3))
    for part in parts:
        arm = part.centre_m - centre
        tensor += part.tensor_kg_m2
        tensor += part.mass_kg * (arm @ arm * np.eye(3) - np.outer(arm, arm))
    return LinkInertia(mass_kg=mass, centre_m=centre, tensor_kg_m2=tensor)


def _of_geoms(document: MjcfDocument, body: BodyElement) -> Iterator[LinkInertia]:
    low, high = numbers(document.compiler.get("inertiagrouprange", _ALL_GROUPS))
    for geom in body.element.findall("geom"):
        attributes = document.attributes(geom, body.child_class)
        if not low <= float(attributes.get("group", "0")) <= high:
            continue
        # A mass counts before a density.
        if float(attributes.get("mass", attributes.get("density", _WATER))) > 0.0:
            yield _of_geom(document, body, attributes)


def _of_geom(document: MjcfDocument, body: BodyElement, attributes: Attributes) -> LinkInertia:
    shape = document.shape(attributes)
    where = f"body {body.name}: geom {attributes.get('name', '')}".rstrip()
    if shape.kind not in _SOLIDS:
        expected = f"one of {', '.join(_SOLIDS)}, or an <inertial> in the body"
        _refuse(document, where, f"a {shape.kind} that has mass", expected)
    if attributes.get("shellinertia", "false") == "true":
        _refuse(document, where, "shellinertia", "a solid geom, or an <inertial> in the body")
    volume, per_kg = _SOLIDS[shape.kind](shape.size_m)
    mass = (
        float(attributes["mass"])
        if "mass" in attributes
        else float(attributes.get("density", _WATER)) * volume
    )
    turned = matrix(np.array(shape.quaternion))
    return LinkInertia(
        mass_kg=mass,
        centre_m=np.array(shape.position_m),
        tensor_kg_m2=mass * turned @ np.diag(per_kg) @ turned.T,
    )


# Each returns the volume in m3 and the principal inertias of 1 kg, of MJCF's half sizes.


def _box(size: Vector) -> tuple[float, Vector]:
    x, y, z = size
    inertia = ((y * y + z * z) / 3, (x * x + z * z) / 3, (x * x + y * y) / 3)
    return 8 * x * y * z, inertia


def _ellipsoid(size: Vector) -> tuple[float, Vector]:
    x, y, z = size
    inertia = ((y * y + z * z) / 5, (x * x + z * z) / 5, (x * x + y * y) / 5)
    return 4 / 3 * math.pi * x * y * z, inertia


def _sphere(size: Vector) -> tuple[float, Vector]:
    return _ellipsoid((size[0], size[0], size[0]))


def _cylinder(size: Vector) -> tuple[float, Vector]:
    radius, half = size
    across = radius * radius / 4 + half * half / 3
    return 2 * math.pi * radius * radius * half, (across, across, radius * radius / 2)


def _capsule(size: Vector) -> tuple[float, Vector]:
    radius, half = size
    tube_volume, tube = _cylinder(size)
    ends_volume = 4 / 3 * math.pi * radius**3
    ends_ratio = ends_volume / (tube_volume + ends_volume)
    end = 2 / 5 * radius * radius
    # Each end's centre of mass is 3/8 of the radius beyond the tube's face.
    ends = (end + half * half + 3 / 4 * half * radius,) * 2 + (end,)
    inertia = (tube[i] * (1 - ends_ratio) + ends[i] * ends_ratio for i in range(3))
    return tube_volume + ends_volume, tuple(inertia)


_SOLIDS: Final[Mapping[str, Callable[[Vector], tuple[float, Vector]]]] = {
    "box": _box,
    "capsule": _capsule,
    "cylinder": _cylinder,
    "ellipsoid": _ellipsoid,
    "sphere": _sphere,
}
