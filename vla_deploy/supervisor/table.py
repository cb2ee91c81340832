"""Declare every process of the robot: the one process table, in start order.

They stop in the reverse order. A process starts when all before it are ready; rows that go with the
previous one start together, and stop together.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from enum import Enum

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
"""Return why the process does not run now, or "" when it does."""


def always(_: RunContext) -> str:
    """Run whatever the robot, the profile and the budgets say."""
    return ""


def twin_only(context: RunContext) -> str:
    """Run only where the twin stands for the hardware."""
    return "" if context.twin else "the run has no twin"


def optional(process: str) -> Predicate:
    """Return a predicate: run where the profile has a budget for it and it is not suspended."""

    def judge(context: RunContext) -> str:
        profile = context.profile
        if process not in profile.budgets:
            return f"profile {profile.name} has no budget for it"
        return context.suspended.get(process, "")

    return judge


def with_parts(process: str, *parts: str) -> Predicate:
    """Return a predicate: as `optional`, but only for a robot that has these parts."""

    def judge(context: RunContext) -> str:
        missing = [part for part in parts if getattr(context.robot.parts, part) is None]
        if missing:
            return f"{context.robot.name} has no {' and no '.join(missing)}"
        return optional(process)(context)

    return judge


def with_sound(context: RunContext) -> str:
    """Run where there is something to hear or to speak with."""
    if context.robot.microphone is None and context.robot.speaker is None:
        return f"{context.robot.name} has no microphone and no speaker"
    return optional("speech")(context)


def ros_asked(context: RunContext) -> str:
    """Run where the run, the robot file or the profile asks for ROS 2."""
    if context.ros or context.robot.ros.enabled or context.profile.ros:
        return with_parts("ros", "base", "lidar", "imu", "camera", "home")(context)
    return "nobody asks for ROS 2: run --ros, or [ros] of the robot file"


@dataclass(frozen=True, slots=True, kw_only=True)
class RestartPolicy:
    """Declare when an ended process is started again, and when no more.

    Failures in a row are counted, not timed: a process that hangs, or never gets ready, takes
    minutes to fail. They are forgotten once it has been ready for `stable_s`. One that fails more
    than `most_in_window` times within `window_s` is given up even if it ran stably in between.
    """

    initial_s: float = 0.25
    factor: float = 2.0
    cap_s: float = 5.0
    max_restarts: int = 5
    stable_s: float = 30.0
    window_s: float = 600.0
    most_in_window: int = 12


class GivingUp(Enum):
    """Declare what happens to the robot when a process is given up."""

    END_RUN = "the run ends with an error, for the service manager to start it anew"
    NO_COMMANDS = "the running command is cancelled, and commands are refused with the reason"
    CARRY_ON = "the others carry on"


@dataclass(frozen=True, slots=True, kw_only=True)
class Watched:
    """Declare a topic by which a process is judged alive.

    Older than `silence_limit_s`, the process is ended and started again; None never ends it. Fewer
    than `rate_ratio` of the declared values within the window raise an alarm. `profile_rate` names
    the profile's rate where that overrules the topic's.
    """

    topic: str
    silence_limit_s: float | None = None
    rate_ratio: float = 0.5
    profile_rate: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class ProcessSpec:
    """Declare one process.

    `command` follows the Python interpreter, `{...}` are filled from the run's options;
    `devices_command` is added where devices are served elsewhere, `viewer_command` with a viewer,
    `paced_command` where buses take their time. It runs while `when` has nothing against it. It
    is ready when `ready_topic` is fresh from its own pid and all `ready_files`, relative to the run
    directory, exist. `watched` are the topics it writes whatever its devices do. `with_previous`
    joins it to the row before: neither waits for the other. `in_ros_environment` runs it by
    ROS's own interpreter.
    """

    name: str
    command: tuple[str, ...]
    devices_command: tuple[str, ...] = ()
    viewer_command: tuple[str, ...] = ()
    paced_command: tuple[str, ...] = ()
    when: Predicate = always
    with_previous: bool = False
    ready_topic: str | None = None
    ready_files: tuple[str, ...] = ()
    ready_timeout_s: float = 40.0
    watched: tuple[Watched, ...] = ()
    in_ros_environment: bool = False
    stop_timeout_s: float = 3.0
    restart: RestartPolicy = RestartPolicy()
    giving_up: GivingUp = GivingUp.NO_COMMANDS


_NODE = ("--run-dir", "{run_dir}", "--robot", "{robot}", "--profile", "{profile}")
_TWIN = (
    *("--robot", "{robot}", "--world", "{world}", "--seed", "{seed}", "--run-dir", "{run_dir}"),
    *("--pace", "{pace}", "--hold-for", "{supervisor_pid}"),
)
_DEVICES = ("--devices-dir", "{devices_dir}")

UNWATCHED_WHEELS_S = 1.0
"""As long a control that hangs may leave wheels turning that have no watchdog of their own."""

TABLE: tuple[ProcessSpec, ...] = (
    ProcessSpec(
        name="twin",
        command=("-m", "sim_twin", *_TWIN),
        viewer_command=("--viewer",),
        paced_command=("--paced",),
        when=twin_only,
        ready_files=("dev/ready",),
        ready_timeout_s=60.0,
        watched=(Watched(topic="twin_status", silence_limit_s=10.0),),
        giving_up=GivingUp.END_RUN,
    ),
    ProcessSpec(
        name="control",
        command=("-m", "vla_deploy.control", *_NODE),
        devices_command=_DEVICES,
        ready_topic="joint_state",
        ready_files=("ready/control",),
        stop_timeout_s=14.0,  # it ramps down, and lowers the arms where power is switched off
        watched=(
            Watched(topic="control_status", silence_limit_s=5.0),
            Watched(topic="joint_state", profile_rate="control_rate_hz"),
        ),
        giving_up=GivingUp.END_RUN,
    ),
    ProcessSpec(
        name="stop_door",
        command=("-m", "vla_deploy.stop_door", *_NODE),
        devices_command=_DEVICES,
        with_previous=True,  # as long as control
        ready_topic="stop_door_status",
        ready_files=("ready/stop_door",),
        watched=(Watched(topic="stop_door_status", silence_limit_s=5.0),),
        giving_up=GivingUp.CARRY_ON,  # dashboard, voice, command line and hardware stop it as well
    ),
    ProcessSpec(
        name="perception",
        command=("-m", "vla_deploy.perception", *_NODE),
        devices_command=_DEVICES,
        when=with_parts("perception", "camera"),
        ready_topic="scene",
        ready_files=("ready/perception",),
        watched=(Watched(topic="scene", silence_limit_s=10.0, profile_rate="perception_rate_hz"),),
    ),
    ProcessSpec(
        name="speech",
        command=("-m", "vla_deploy.speech", *_NODE),
        devices_command=_DEVICES,
        when=with_sound,
        with_previous=True,
        ready_topic="speech_status",
        ready_files=("ready/speech",),
        watched=(Watched(topic="speech_status", silence_limit_s=10.0),),
        giving_up=GivingUp.CARRY_ON,  # typed commands go on
    ),
    ProcessSpec(
        name="planner",
        command=("-m", "vla_deploy.planning", *_NODE),
        devices_command=_DEVICES,
        when=optional("planner"),
        with_previous=True,
        ready_files=("ready/planner",),
        watched=(Watched(topic="planner_status", silence_limit_s=5.0),),
    ),
    ProcessSpec(
        name="executor",
        command=("-m", "vla_deploy.skills", *_NODE),
        devices_command=_DEVICES,
        when=optional("executor"),
        with_previous=True,
        ready_topic="executor_status",
        ready_files=("ready/executor",),
        watched=(Watched(topic="executor_status", silence_limit_s=5.0),),
    ),
    ProcessSpec(
        name="recorder",
        command=("-m", "vla_deploy.telemetry", *_NODE),
        with_previous=True,
        ready_topic="recorder_status",
        ready_files=("ready/recorder",),
        watched=(Watched(topic="recorder_status", silence_limit_s=5.0),),
        stop_timeout_s=10.0,  # what waits to be written is written first
        giving_up=GivingUp.CARRY_ON,
    ),
    ProcessSpec(
        name="dashboard",
        command=("-m", "vla_deploy.dashboard", *_NODE),
        devices_command=_DEVICES,
        when=optional("dashboard"),
        with_previous=True,
        ready_topic="dashboard_status",
        ready_files=("ready/dashboard",),
        ready_timeout_s=60.0,
        watched=(Watched(topic="dashboard_status", silence_limit_s=15.0),),
        giving_up=GivingUp.CARRY_ON,  # the stop door and the command line go on
    ),
    ProcessSpec(
        name="ros",
        command=("-m", "vla_deploy.gateways.ros", *_NODE),
        devices_command=_DEVICES,
        when=ros_asked,
        with_previous=True,
        ready_topic="ros_status",
        ready_files=("ready/ros",),
        ready_timeout_s=60.0,
        watched=(Watched(topic="ros_status", silence_limit_s=10.0),),
        in_ros_environment=True,
        giving_up=GivingUp.CARRY_ON,  # it is then not moved over ROS
    ),
)


def table_of(robot: RobotDescription) -> tuple[ProcessSpec, ...]:
    """Return the table for a robot: wheels that no watchdog stops wait for no hung control."""
    if not robot.servo_bus.wheels:
        return TABLE
    return tuple(_sooner(spec) if spec.name == "control" else spec for spec in TABLE)


def _sooner(spec: ProcessSpec) -> ProcessSpec:
    limits_s = (one.silence_limit_s and UNWATCHED_WHEELS_S for one in spec.watched)
    watched = zip(spec.watched, limits_s, strict=True)
    return replace(
        spec, watched=tuple(replace(one, silence_limit_s=limit_s) for one, limit_s in watched)
    )
