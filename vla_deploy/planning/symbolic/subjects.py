"""Tell which thing the words of a plan name, so that "red cup" and "cup_1" are one thing."""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final

from vla_deploy.planning.references import parse_object
from vla_deploy.world import Snapshot, Thing

# How heavy a thing of a kind may be for its outer size, full where it can be filled. A bowl is
# mostly air, keys are.
DENSITY_KG_M3: Final[Mapping[str, float]] = MappingProxyType(
    {
        "cup": 800.0, "ball": 1000.0, "book": 700.0, "bottle": 750.0, "phone": 2500.0,
        "keys": 2500.0, "bowl": 400.0, "can": 800.0, "remote": 1000.0,
    }
)  # fmt: skip
OTHER_DENSITY_KG_M3: Final = 700.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Subject:
    """Hold what a parameter names; `key` is the id of the thing where exactly one fits."""

    key: str
    kind: str
    words: str
    thing: Thing | None = None
    others: int = 0

    @property
    def mass_kg(self) -> float | None:
        """Return the most that it may weigh by its size, None where its size is not known."""
        if self.thing is None:
            return None
        length_m, width_m, height_m = self.thing.size_m
        density = DENSITY_KG_M3.get(self.kind, OTHER_DENSITY_KG_M3)
        return density * length_m * width_m * height_m


def subject_of(text: str, scene: Snapshot | None) -> Subject:
    """Read a parameter that names a thing.

    Raises:
        UnknownObject: it names none that the robot knows.
    """
    query = parse_object(text)
    found = query.among(scene) if scene is not None else []
    words = str(query)
    if len(found) == 1 or (found and query.asked.order):
        thing = found[0]
        return Subject(key=thing.thing_id, kind=thing.kind, words=words, thing=thing)
    return Subject(key=words, kind=query.kind, words=words, others=len(found))
