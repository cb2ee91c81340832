"""Say when a process of the table runs: small functions over one immutable picture of the run."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from importlib.util import find_spec

from platforms import Profile
from vla_deploy.robots import RobotDescription


@dataclass(frozen=True, slots=True, kw_only=True)
class RunContext:
    """Hold all that decides which processes run; `suspended` maps a process to the reason."""

    twin: bool
    robot: RobotDescription
    profile: Profile
    suspended: Mapping[str, str] = field(default_factory=dict)
    ros: bool = False


Predicate = Callable[[RunContext], str]
"""Returns why the process does not run now, or "" when it does."""


def always(_: RunContext) -> str:
    """Run whatever the robot, the profile and the budgets say."""
    return ""


def twin_only(context: RunContext) -> str:
    """Run only where the twin stands for the hardware."""
    return "" if context.twin else "the run has no twin"


def device_declared(kind: str) -> Predicate:
    """Return a predicate: run where the robot file declares a device, by its attribute's name."""

    def judge(context: RunContext) -> str:
        declared = getattr(context.robot, kind)
        return "" if declared is not None else f"robot {context.robot.name} declares no {kind}"

    return judge


def budgeted(process: str) -> Predicate:
    """Return a predicate: run where the profile gives the process a budget."""

    def judge(context: RunContext) -> str:
        profile = context.profile
        return "" if process in profile.budgets else f"profile {profile.name} has no budget for it"

    return judge


def ros_asked(context: RunContext) -> str:
    """Run where the run, the robot file or the profile asks for ROS 2."""
    asked = context.ros or context.robot.ros.enabled or context.profile.ros
    return "" if asked else "nobody asks for ROS 2: run --ros, or [ros] of the robot file"


def not_suspended(process: str) -> Predicate:
    """Return a predicate: run unless the budgets have suspended the process."""
    return lambda context: context.suspended.get(process, "")


def installed(module: str, extra: str) -> Predicate:
    """Return a predicate: run where an optional part is installed."""

    def judge(_: RunContext) -> str:
        if find_spec(module) is not None:
            return ""
        return f"{module} is not installed: pip install 'vla-deploy[{extra}]'"

    return judge


def all_of(*predicates: Predicate) -> Predicate:
    """Return a predicate: run where all of these run; the first reason against it is told."""

    def judge(context: RunContext) -> str:
        return next((reason for one in predicates if (reason := one(context))), "")

    return judge


def any_of(*predicates: Predicate) -> Predicate:
    """Return a predicate: run where one of these runs; all reasons against it are told."""

    def judge(context: RunContext) -> str:
        reasons = [one(context) for one in predicates]
        return "" if "" in reasons else "; ".join(reasons)

    return judge
