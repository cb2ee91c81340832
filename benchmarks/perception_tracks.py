"""Judge the memory of things beside the twin's truth: ids, what is lost, what is found again.

The whole robot works in lock-step; every told scene is compared with where things really are.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from vla_deploy.perception.assignment import assign

GATE_M = 0.15
"""A told thing farther from every real one is none of them."""


@dataclass(slots=True)
class IdentityWatch:
    """Count per real thing under how many ids it went, as CLEAR MOT counts switches.

    A thing goes by the id that it had as long as that one is told near it; only then by another.
    """

    ids: dict[str, str] = field(default_factory=dict)
    switches: list[str] = field(default_factory=list)
    looks: int = 0
    followed: int = 0
    false_things: int = 0

    def look(self, told: Sequence[Mapping[str, Any]], real: Mapping[str, Any]) -> None:
        """Compare one told scene with the truth's objects."""
        things = {str(one["id"]): one["position_m"] for one in told}
        bodies = {name: body["position_m"] for name, body in real.items()}
        kept = {
            name: known
            for name, known in self.ids.items()
            if known in things and math.dist(things[known], bodies[name]) < GATE_M
        }
        found = kept | self._new_pairs(
            {name: at for name, at in things.items() if name not in kept.values()},
            {name: at for name, at in bodies.items() if name not in kept},
        )
        for name, thing in found.items():
            before = self.ids.get(name)
            if before not in (None, thing):
                self.switches.append(f"{name}: {before} -> {thing}")
        self.ids |= found
        self.looks += 1
        self.followed += len(found)
        self.false_things += len(things) - len(found)

    @staticmethod
    def _new_pairs(
        things: Mapping[str, Sequence[float]], bodies: Mapping[str, Sequence[float]]
    ) -> dict[str, str]:
        apart = [[math.dist(at, there) for there in things.values()] for at in bodies.values()]
        pairs = assign(np.array(apart).reshape(len(bodies), len(things)), GATE_M)
        names, ids = list(bodies), list(things)
        return {names[row]: ids[column] for row, column in pairs}
