"""Be a person in the twin's world: walk about, take things, also from the robot, put them down.

A thing that a hand holds is pulled at ever harder, away from the robot, until the hand lets go or
the person gives up; the robot feels it in its joints as it would feel a real pull.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from sim_twin.errors import RefereeRefusal
from sim_twin.physics.compose import ROBOT_ROOT, STEP_S
from sim_twin.physics.engine import Engine

PULL_N_S: Final = 15.0
MOST_N: Final = 8.0
"""How fast a person takes a light thing, and how hard."""
PATIENCE_S: Final = 5.0
FREE_S: Final = 0.05
"""The fingers may touch a thing again just after they have opened."""
NOWHERE_M: Final = (100.0, -4.0)
AWAY_M: Final = (100.0, 0.0)
"""Where things are that the person keeps: on the ground, far from every wall."""
BODY: Final = "person"
"""The mocap body of a world that has a person to be seen."""
FASTEST_M_S: Final = 3.0
YIELDS_M: Final = 0.6
"""Nobody walks into a robot: so near before its middle they stand until it is out of their way."""
REACH_M: Final = 50.0
"""The map's bounds: nothing is put further away."""


@dataclass(slots=True)
class _Pull:
    name: str
    direction: NDArray[np.float64]
    for_s: float = 0.0
    free_s: float = 0.0


class WorldPerson:
    """Take and put down what lies about or what the robot holds; step it before the physics."""

    def __init__(self, engine: Engine) -> None:
        self._engine = engine
        self._pull: _Pull | None = None
        self._furniture = tuple(one for one in engine.brought if one != BODY)
        self._away: set[str] = set(self._furniture)
        """What of the furniture is not there."""
        self._taken: list[str] = []
        self._told = ""
        self._robot = engine.model.body(ROBOT_ROOT).id
        self._at: NDArray[np.float64] | None = None
        self._way: list[NDArray[np.float64]] = []
        self._speed_m_s = 0.0

    @property
    def taken(self) -> tuple[str, ...]:
        """Return the names of the things that the person has."""
        return tuple(self._taken)

    @property
    def pulls_at(self) -> str | None:
        """Return the name of the thing in the robot's hand that the person pulls at."""
        return None if self._pull is None else self._pull.name

    def document(self) -> dict[str, Any]:
        """Return where each thing is, what the person has and pulls at, and why a pull ended."""
        truth = self._engine.referee.truth()
        things = {name: one["position_m"] for name, one in truth["objects"].items()}
        return {
            "things": {name: at for name, at in things.items() if name not in self._taken},
            "held_by_robot": truth["held"],
            "taken": [*self._taken, *sorted(self._away)],
            "pulls_at": self.pulls_at,
            "at_m": None if self._at is None else self._at.tolist(),
            "walks": bool(self._way),
            "told": self._told,
        }

    def take(self, name: str) -> None:
        """Take a thing at once, or begin to pull at it where the robot touches it.

        Raises:
            RefereeRefusal: there is no such thing, or the person has it, or pulls at another.
        """
        if name in self._taken or name in self._away:
            raise RefereeRefusal(f"the person has the {name} already; put it somewhere first")
        if name in self._furniture:
            self._put_away(name)
            return
        truth = self._truth_with(name)
        if self._pull is not None:
            raise RefereeRefusal(f"the person pulls at {self._pull.name}; wait until that ends")
        self._told = ""
        robot, at_m = truth["robot"], truth["objects"][name]["position_m"]
        away = np.array([at_m[0] - robot["x_m"], at_m[1] - robot["y_m"], 0.0])
        self._pull = _Pull(name, away / max(float(np.linalg.norm(away)), 1e-6))
        if not self._engine.referee.touches_robot(name):
            self._keep()

    def put(self, name: str, place: Mapping[str, Any]) -> None:
        """Put a thing down, at rest: `x_m`, `y_m`, `z_m` of its origin in the map, `yaw_rad`.

        Raises:
            RefereeRefusal: there is no such thing, the place is no place, or the robot holds it.
        """
        if name not in self._furniture:
            self._truth_with(name)
        numbers = [place.get(key) for key in ("x_m", "y_m", "z_m", "yaw_rad")]
        if not all(map(_is_near, numbers)):
            raise RefereeRefusal(
                f"expected x_m, y_m, z_m and yaw_rad within {REACH_M:g}, got {dict(place)}"
            )
        is_thing = name not in self._furniture
        if self.pulls_at == name or (is_thing and self._engine.referee.touches_robot(name)):
            raise RefereeRefusal(f"the robot touches the {name}; take it first")
        self._engine.place(name, *(float(one) for one in numbers if one is not None))
        self._taken = [one for one in self._taken if one != name]
        self._away.discard(name)

    def walk(self, way_m: Any, speed_m_s: Any) -> None:
        """Appear at the first of (n, 2) points of the map, and walk on along the others.

        No points: go away. The legs do not swing.

        Raises:
            RefereeRefusal: the world has no person to be seen, or the way is none.
        """
        if BODY not in self._engine.brought:
            raise RefereeRefusal("this world has no person that is seen; the flat has")
        if not isinstance(way_m, list | tuple) or not all(map(_is_point, way_m)):
            raise RefereeRefusal(f"expected points x, y within {REACH_M:g} m, got {way_m!r}")
        if not _is_near(speed_m_s) or not 0.0 < speed_m_s <= FASTEST_M_S:
            raise RefereeRefusal(f"expected a speed up to {FASTEST_M_S:g} m/s, got {speed_m_s!r}")
        self._way = [np.array(point, dtype=np.float64) for point in way_m]
        self._speed_m_s, self._at = float(speed_m_s), self._way.pop(0) if self._way else None
        x_m, y_m = NOWHERE_M if self._at is None else self._at.tolist()
        self._engine.place(BODY, x_m, y_m, 0.0, 0.0)

    def step(self) -> None:
        """Walk on; pull a little harder, keep what has come free, or give up."""
        self._walk_on()
        if (pull := self._pull) is None:
            return
        pull.for_s += STEP_S
        is_free = not self._engine.referee.touches_robot(pull.name)
        pull.free_s = pull.free_s + STEP_S if is_free else 0.0
        if pull.free_s > FREE_S:
            self._keep()
        elif pull.for_s > PATIENCE_S:
            self._let_go(f"the robot did not let go of the {pull.name} within {PATIENCE_S:g} s")
        else:
            body = self._engine.model.body(pull.name).id
            force_n = min(MOST_N, PULL_N_S * pull.for_s)
            self._engine.data.xfrc_applied[body, :3] = force_n * pull.direction

    def _walk_on(self) -> None:
        if self._at is None or not self._way:
            return
        left, robot = self._way[0] - self._at, self._engine.data.xpos[self._robot, :2]
        if math.dist(robot, self._at) < YIELDS_M and float((robot - self._at) @ left) > 0.0:
            return
        left_m, step_m = float(np.hypot(*left)), self._speed_m_s * STEP_S
        self._at = self._way.pop(0) if left_m <= step_m else self._at + left * (step_m / left_m)
        if left_m > 0.0:
            heading_rad = math.atan2(left[1], left[0])
            self._engine.move(BODY, float(self._at[0]), float(self._at[1]), heading_rad)

    def _put_away(self, name: str) -> None:
        self._engine.place(name, *AWAY_M, 0.0, 0.0)
        self._away.add(name)

    def _keep(self) -> None:
        if (pull := self._pull) is None:
            return
        self._let_go("")
        model = self._engine.model
        geoms = np.flatnonzero(model.geom_bodyid == model.body(pull.name).id)
        radius_m = max(
            float(np.linalg.norm(model.geom_pos[geom]) + model.geom_rbound[geom]) for geom in geoms
        )
        row_m = AWAY_M[1] + float(len(self._taken))
        self._engine.place(pull.name, AWAY_M[0], row_m, radius_m, 0.0)
        self._taken.append(pull.name)

    def _let_go(self, told: str) -> None:
        if self._pull is not None:
            self._engine.data.xfrc_applied[self._engine.model.body(self._pull.name).id] = 0.0
        self._pull, self._told = None, told

    def _truth_with(self, name: str) -> dict[str, Any]:
        """Return what the physics knows of the world and of a thing in it.

        Raises:
            RefereeRefusal: the world has no such thing.
        """
        truth = self._engine.referee.truth()
        things = truth["objects"]
        if name not in things:
            raise RefereeRefusal(f"the world has no thing {name!r}; there are {', '.join(things)}")
        if not all(map(math.isfinite, things[name]["position_m"])):
            raise RefereeRefusal(f"the {name} is nowhere: the physics has lost it")
        return truth


def _is_near(number: object) -> bool:
    return isinstance(number, int | float) and abs(number) <= REACH_M


def _is_point(point: object) -> bool:
    return isinstance(point, list | tuple) and len(point) == 2 and all(map(_is_near, point))
