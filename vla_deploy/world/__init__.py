"""Know the world: what rests where, how things lie to each other, what can be taken, what is lost.

Everything here is a value or a pure step. Perception keeps the state and tells it as the scene
topic; planner, skills, page and command line read that into a `Snapshot` and ask.
"""

from vla_deploy.world.access import Body, GraspAccess, access_to
from vla_deploy.world.document import read_snapshot
from vla_deploy.world.errors import SceneUnreadable, UnknownWord, WorldError
from vla_deploy.world.query import Query, find, parse_query
from vla_deploy.world.relations import Relation, relations_of
from vla_deploy.world.thing import Snapshot, Thing, Viewpoint

__all__ = [
    "Body",
    "GraspAccess",
    "Query",
    "Relation",
    "SceneUnreadable",
    "Snapshot",
    "Thing",
    "UnknownWord",
    "Viewpoint",
    "WorldError",
    "access_to",
    "find",
    "parse_query",
    "read_snapshot",
    "relations_of",
]
