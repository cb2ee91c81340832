"""Declare every process of the robot: the one process table, in start order.

They stop in the reverse order. Whoever starts waits until all before it are ready.
"""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class RestartPolicy:
    """Declare when an ended process is started again, and when no more."""

    initial_s: float = 0.25
    factor: float = 2.0
    cap_s: float = 5.0
    window_s: float = 60.0
    max_restarts: int = 5


@dataclass(frozen=True, slots=True, kw_only=True)
class ProcessSpec:
    """Declare one process.

    `command` follows the Python interpreter, `{...}` are filled from the run's options;
    `twin_command` is added in twin mode, `viewer_command` with a viewer, `paced_command` where
    buses take their time. It is ready when
    `ready_topic` is fresh from its own pid and all `ready_files`, relative to the run directory,
    exist. Once ready it is killed, and so started again, when `alive_topic`, which it writes
    whatever its devices do, is older than `silence_limit_s`.
    """

    name: str
    command: tuple[str, ...]
    twin_command: tuple[str, ...] = ()
    viewer_command: tuple[str, ...] = ()
    paced_command: tuple[str, ...] = ()
    needs_twin: bool = False
    ready_topic: str | None = None
    ready_files: tuple[str, ...] = ()
    ready_timeout_s: float = 20.0
    alive_topic: str | None = None
    silence_limit_s: float = 5.0
    stop_timeout_s: float = 3.0
    restart: RestartPolicy = RestartPolicy()


_NODE = ("--run-dir", "{run_dir}", "--robot", "{robot}", "--profile", "{profile}")
_TWIN = ("--robot", "{robot}", "--world", "{world}", "--seed", "{seed}", "--run-dir", "{run_dir}")
_DEVICES = ("--devices-dir", "{run_dir}/dev")

TABLE: tuple[ProcessSpec, ...] = (
    ProcessSpec(
        name="twin",
        command=("-m", "sim_twin", *_TWIN),
        viewer_command=("--viewer",),
        paced_command=("--paced",),
        needs_twin=True,
        ready_files=("dev/ready",),
        ready_timeout_s=60.0,
    ),
    ProcessSpec(
        name="control",
        command=("-m", "vla_deploy.control", *_NODE),
        twin_command=_DEVICES,
        ready_topic="joint_state",
        ready_files=("ready/control",),
        stop_timeout_s=5.0,
        alive_topic="control_status",
    ),
    ProcessSpec(
        name="perception",
        command=("-m", "vla_deploy.perception", *_NODE),
        twin_command=_DEVICES,
        ready_topic="scan",
        ready_files=("ready/perception",),
        ready_timeout_s=40.0,
        alive_topic="scene",
        silence_limit_s=10.0,
    ),
    ProcessSpec(
        name="planner",
        command=("-m", "vla_deploy.planning", *_NODE),
        twin_command=_DEVICES,
        ready_files=("ready/planner",),
    ),
    ProcessSpec(
        name="executor",
        command=("-m", "vla_deploy.skills", *_NODE),
        twin_command=_DEVICES,
        ready_topic="executor_status",
        ready_files=("ready/executor",),
        alive_topic="executor_status",
    ),
)
