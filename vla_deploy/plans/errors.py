"""Group the errors of plans by what their author can do.

PlanError
├── UnknownPlace      name a place the robot knows
├── UnknownObject     name a kind of object the robot knows
│   └── DependsOnView say what it stands on, in or next to
├── UnknownDevice     name a device of the robot file
├── AgentRefused      let a person grant a lease, or do it: an agent asked (plans.agent_rules)
└── PlanInvalid       mend the plan; carries every fault

`vla_deploy.planning.errors` adds why there is no plan for a command.
"""

from collections.abc import Iterable, Sequence

from vla_deploy.runtime.one_line import one_line


class PlanError(Exception):
    """Base of every refusal to make or to carry out a plan.

    `action_id` is the action of the plan that it is about, "" where it is about no single one.
    """

    action_id = ""


class UnknownPlace(PlanError):
    """Say that a place is not in the robot file."""

    def __init__(self, name: str, known: Iterable[str]) -> None:
        places = ", ".join(sorted(known))
        rest = f"I know: {places}" if places else "I know of none"
        super().__init__(f'I do not know the place "{name}"; {rest}')


class UnknownObject(PlanError):
    """Say that a kind of object is none the robot can recognise."""

    def __init__(self, name: str, known: Iterable[str]) -> None:
        super().__init__(
            f'I do not know the object "{name}"; I can handle: {", ".join(sorted(known))}'
        )


class DependsOnView(UnknownObject):
    """Say that where an object is depends on who looks, and changes while the robot drives."""

    def __init__(self, name: str) -> None:
        PlanError.__init__(
            self,
            f'"{name}": left, right, in front and behind change while I drive; say what it is '
            "on, in or next to",
        )


class UnknownDevice(PlanError):
    """Say that a device of the home is not in the robot file."""

    def __init__(self, name: str, known: Iterable[str]) -> None:
        listed = ", ".join(sorted(known)) or "none"
        super().__init__(f'I do not know the device "{name}"; I can switch: {listed}')


class PlanInvalid(PlanError):
    """Say everything that is wrong with a plan, in one line.

    `dependency_faults` are those of `faults` that are about the order of its actions.
    """

    def __init__(self, faults: Sequence[str], dependency_faults: Sequence[str] = ()) -> None:
        self.faults = (*faults, *dependency_faults)
        self.dependency_faults = tuple(dependency_faults)
        super().__init__(one_line("the plan was refused: " + "; ".join(self.faults)))
