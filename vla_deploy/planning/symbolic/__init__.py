"""Know plans as symbols: what each skill needs and leaves, and what holds at each step."""

from vla_deploy.planning.symbolic.simulation import (
    after,
    bounds_faults,
    end_state,
    symbolic_faults,
)
from vla_deploy.planning.symbolic.state import Held, State, state_of
from vla_deploy.planning.symbolic.table import LOGIC, Logic

__all__ = [
    "LOGIC",
    "Held",
    "Logic",
    "State",
    "after",
    "bounds_faults",
    "end_state",
    "state_of",
    "symbolic_faults",
]
