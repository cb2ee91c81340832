"""Declare every topic between the robot's processes: the one schema table.

Cells carry packed fields (or one bounded JSON text), rings carry JSON objects, frame rings carry
images, record rings bytes of their one writer. The layout of shared memory, the recording channel
and the metric all come from here.
"""

from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING, Annotated, Any, Final, Generic

from vla_deploy.ipc.claims import Book
from vla_deploy.ipc.payloads import motion, recording, scene, services, speech, supervision, tasks
from vla_deploy.ipc.ros_goals import GoalAnswer, GoalRequest

if TYPE_CHECKING:
    from typing_extensions import TypeForm, TypeVar

    P = TypeVar("P", default=None)
else:
    from typing import TypeVar

    P = TypeVar("P")

MAX_JOINTS = 32
SCAN_BEAMS = 360
OBSTACLE_POINTS = 256
MOVERS = 8


class TopicKind(Enum):
    """Name what a reader may rely on."""

    CELL = "latest-value cell"
    RING = "event ring"
    FRAME = "frame ring"
    RECORD = "record ring"


@dataclass(frozen=True, slots=True)
class PackedField:
    """Describe one packed field; `dtype` is a numpy code, little-endian, "json" is bounded text.

    A writer that leaves out one that it `may_lack` puts zero.
    """

    name: str
    dtype: str
    shape: int = 1
    unit: str = ""
    may_lack: bool = False


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Topic(Generic[P]):
    """Describe one topic.

    `owner` is the only process that writes it; "any" marks a ring, or a document
    changed in turns, with many writers.
    `rate_hz` 0 means "on change"; `deadline_s` is the age above which a reader calls it stale.
    `payload` is the type of its JSON object, None where it carries none: a `TypedDict` of
    `payloads`, or a dataclass whose fields are the keys.
    What a `private` topic carries is kept by no recording.
    """

    name: str
    kind: TopicKind
    owner: str
    summary: str
    payload: "TypeForm[P]" = None  # type: ignore[assignment]
    fields: tuple[PackedField, ...] = ()
    rate_hz: float = 0.0
    deadline_s: float = 0.0
    slots: int = 4
    slot_bytes: int = 0
    private: bool = False


def _joint(name: str, dtype: str, unit: str) -> PackedField:
    return PackedField(name, dtype, MAX_JOINTS, unit)


JOINT_STATE = Topic(
    name="joint_state",
    kind=TopicKind.CELL,
    owner="control",
    rate_hz=250,
    deadline_s=0.05,
    summary="every servo joint, in the order of the robot file",
    fields=(
        PackedField("joint_count", "u4"),
        _joint("position", "f8", "rad or m"),
        _joint("velocity", "f8", "rad/s or m/s"),
        _joint("setpoint", "f8", "rad or m"),
        _joint("effort_ratio", "f4", "of stall torque"),
        _joint("age_s", "f4", "s"),
        _joint("error", "u1", "hardware error bits"),
        _joint("torque_enabled", "u1", ""),
    ),
)
_LEFT: Final = PackedField("left_m_s", "f8", unit="m/s, of omni wheels", may_lack=True)
BASE_STATE = Topic(
    name="base_state",
    kind=TopicKind.CELL,
    owner="control",
    rate_hz=250,
    deadline_s=0.1,
    summary="wheel odometry, odom frame: starts at 0, 0, 0",
    fields=(
        PackedField("x_m", "f8", unit="m"),
        PackedField("y_m", "f8", unit="m"),
        PackedField("yaw_rad", "f8", unit="rad"),
        PackedField("v_m_s", "f8", unit="m/s"),
        PackedField("w_rad_s", "f8", unit="rad/s"),
        PackedField("enabled", "u1"),
        _LEFT,
    ),
)
BASE_COMMAND = Topic(
    name="base_command",
    kind=TopicKind.CELL,
    owner="executor",
    rate_hz=50,
    deadline_s=0.25,
    summary="wanted base velocity; too old means ramp to zero",
    fields=(
        PackedField("v_m_s", "f8", unit="m/s"),
        PackedField("w_rad_s", "f8", unit="rad/s"),
        _LEFT,
    ),
)
CONTROL_STATUS = Topic(
    name="control_status",
    kind=TopicKind.CELL,
    owner="control",
    rate_hz=20,
    deadline_s=0.2,
    summary="control state, active verdict, tick statistics, as JSON; what changes, sooner",
    payload=motion.ControlStatus,
    fields=(PackedField("document", "json", 8192),),
)
TICK_RECORD = Topic(
    name="tick_record",
    kind=TopicKind.RECORD,
    owner="control",
    rate_hz=250,
    summary="what every tick was judged by and what was sent, for the flight recorder",
    slots=16384,
    slot_bytes=976,
)
FLIGHT_REQUEST = Topic(
    name="flight_request",
    kind=TopicKind.RING,
    owner="any",
    summary="a request to write what the flight recorder holds, with its reason",
    payload=recording.FlightRequest,
    slots=16,
    slot_bytes=1024,
)
FLIGHT_EVENT = Topic(
    name="flight_event",
    kind=TopicKind.RING,
    owner="recorder",
    summary="a flight was saved, or could not be, with its file and causes",
    payload=recording.FlightEvent,
    slots=32,
    slot_bytes=4096,
)
RECORDER_STATUS = Topic(
    name="recorder_status",
    kind=TopicKind.CELL,
    owner="recorder",
    rate_hz=2,
    deadline_s=3.0,
    summary="what the flight recorder holds and whether it writes, as JSON",
    payload=recording.RecorderStatus,
    fields=(PackedField("document", "json", 256),),
)
RECORDING_REQUEST = Topic(
    name="recording_request",
    kind=TopicKind.RING,
    owner="any",
    summary="asks the recorder to begin or to end a rolling recording: topics, duration, label",
    payload=recording.RecordingMessage,
    slots=16,
    slot_bytes=4096,
)
RECORDING_STATUS = Topic(
    name="recording_status",
    kind=TopicKind.CELL,
    owner="recorder",
    rate_hz=2,
    deadline_s=3.0,
    summary="whether a rolling recording is made, into which file, what was lost, as JSON",
    payload=recording.RecordingStatus,
    fields=(PackedField("document", "json", 4096),),
)
REPLAY_REQUEST = Topic(
    name="replay_request",
    kind=TopicKind.RING,
    owner="any",
    summary="asks a replay to pause, to go on, to seek, to go at another speed",
    payload=recording.ReplayRequest,
    slots=16,
    slot_bytes=512,
)
REPLAY_STATUS = Topic(
    name="replay_status",
    kind=TopicKind.CELL,
    owner="replay",
    rate_hz=2,
    deadline_s=3.0,
    summary="which file is replayed, where it stands, at which speed, as JSON",
    payload=recording.ReplayStatus,
    fields=(PackedField("document", "json", 1024),),
)
MOTION_COMMAND = Topic(
    name="motion_command",
    kind=TopicKind.RING,
    owner="executor",
    summary="joint goals, trajectories and cancels for control",
    payload=motion.MotionCommand,
    slots=32,
    slot_bytes=65536,
)
MOTION_RESULT = Topic(
    name="motion_result",
    kind=TopicKind.RING,
    owner="control",
    summary="end of each motion: done, touched, cancelled, refused, stopped, with the reason",
    payload=motion.MotionEnd,
    slots=64,
    slot_bytes=2048,
)
OPERATOR = Topic(
    name="operator",
    kind=TopicKind.RING,
    owner="any",
    summary="estop, reset, arm, disarm; straight to control",
    payload=motion.OperatorRequest,
    slots=64,
    slot_bytes=1024,
)
POSE = Topic(
    name="pose",
    kind=TopicKind.CELL,
    owner="perception",
    rate_hz=50,
    deadline_s=0.5,
    summary="robot base in the map frame",
    fields=(
        PackedField("x_m", "f8", unit="m"),
        PackedField("y_m", "f8", unit="m"),
        PackedField("yaw_rad", "f8", unit="rad"),
        PackedField("match_ratio", "f8", unit="share of lidar points on the map"),
        PackedField("covariance", "f8", 9, "x, y, yaw by rows, m and rad"),
        PackedField("state", "u1", unit="0 tracking, 1 unsure, 2 lost"),
        PackedField("doubt", "u1", unit="why, see vla_deploy/client/place_state.py"),
    ),
)
SCAN = Topic(
    name="scan",
    kind=TopicKind.CELL,
    owner="perception",
    rate_hz=10,
    deadline_s=0.5,
    summary="planar lidar; beam i at angle i degrees counter-clockwise from the robot's front",
    fields=(
        PackedField("range_m", "f4", SCAN_BEAMS, "m, 0 is no return"),
        PackedField("beam_age_s", "f4", SCAN_BEAMS, "s, from the beam's moment to the stamp"),
    ),
)
NEAR_OBSTACLES = Topic(
    name="near_obstacles",
    kind=TopicKind.CELL,
    owner="perception",
    rate_hz=5,
    deadline_s=1.0,
    summary="depth camera: what stands up from the floor, nearest first, in the base frame",
    fields=(
        PackedField("count", "u4"),
        PackedField("period_s", "f4", unit="s, between two looks, by the profile and its ladder"),
        PackedField("x_m", "f4", OBSTACLE_POINTS, "m"),
        PackedField("y_m", "f4", OBSTACLE_POINTS, "m"),
        PackedField("z_m", "f4", OBSTACLE_POINTS, "m"),
    ),
)
LIVE_OBSTACLES = Topic(
    name="live_obstacles",
    kind=TopicKind.CELL,
    owner="perception",
    rate_hz=10,
    deadline_s=1.0,
    summary="what lidar and depth camera see beside the map, nearest first, and what of it moves",
    fields=(
        PackedField("count", "u4"),
        PackedField("x_m", "f4", OBSTACLE_POINTS, "m, of a cell's middle in the map frame"),
        PackedField("y_m", "f4", OBSTACLE_POINTS, "m"),
        PackedField("mover_count", "u4"),
        PackedField("mover_x_m", "f4", MOVERS, "m, in the map frame"),
        PackedField("mover_y_m", "f4", MOVERS, "m"),
        PackedField("mover_vx_m_s", "f4", MOVERS, "m/s"),
        PackedField("mover_vy_m_s", "f4", MOVERS, "m/s"),
    ),
)
IMU = Topic(
    name="imu",
    kind=TopicKind.CELL,
    owner="perception",
    rate_hz=100,
    deadline_s=0.2,
    summary="orientation and acceleration in the base frame",
    fields=(
        PackedField("yaw_rad", "f8", unit="rad"),
        PackedField("pitch_rad", "f8", unit="rad"),
        PackedField("roll_rad", "f8", unit="rad"),
        PackedField("acceleration_m_s2", "f8", 3, "m/s^2"),
    ),
)
SCENE = Topic(
    name="scene",
    kind=TopicKind.CELL,
    owner="perception",
    rate_hz=5,
    deadline_s=2.0,
    summary="objects with id, class, colour, map-frame position, size, last seen, as JSON",
    payload=scene.SceneDocument,
    fields=(PackedField("document", "json", 32768),),
)
RGBD = Topic(
    name="rgbd",
    kind=TopicKind.FRAME,
    owner="perception",
    rate_hz=5,
    deadline_s=2.0,
    summary="head camera: uint8 RGB then uint16 depth in millimetres",
    slots=4,
    slot_bytes=640 * 480 * 5,
)
UTTERANCE = Topic(
    name="utterance",
    kind=TopicKind.RING,
    owner="any",
    summary="a command in words, or a whole plan as JSON, with its command id",
    payload=tasks.Utterance,
    slots=32,
    slot_bytes=65536,
)
SAY = Topic(
    name="say",
    kind=TopicKind.RING,
    owner="any",
    summary="what the robot is to say aloud: say id and text; or a say id to take back",
    payload=speech.SayMessage,
    slots=32,
    slot_bytes=8192,
)
VOICE_EVENT = Topic(
    name="voice_event",
    kind=TopicKind.RING,
    owner="speech",
    summary="what became of what was to be said: began, finished, interrupted, failed, dropped",
    payload=speech.VoiceEvent,
    slots=64,
    slot_bytes=1024,
)
AGENT_LEASE = Topic(
    name="agent_lease",
    kind=TopicKind.CELL,
    owner="any",
    summary="until when agents may give commands, and who said so, as JSON; on change",
    payload=tasks.AgentLease,
    fields=(PackedField("document", "json", 1024),),
)
PLAN = Topic(
    name="plan",
    kind=TopicKind.RING,
    owner="planner",
    summary="validated plans for the executor",
    payload=tasks.PlanMessage,
    slots=16,
    slot_bytes=65536,
)
TASK_EVENT = Topic(
    name="task_event",
    kind=TopicKind.RING,
    owner="any",
    summary="what became of a command: planning, asked, plan, rejected, action, said, finished",
    payload=tasks.TaskEvent,
    slots=256,
    slot_bytes=32768,
)
EXECUTOR_STATUS = Topic(
    name="executor_status",
    kind=TopicKind.CELL,
    owner="executor",
    rate_hz=10,
    deadline_s=1.0,
    summary="active command and action, what each hand holds, as JSON",
    payload=tasks.ExecutorStatus,
    fields=(PackedField("document", "json", 8192),),
)
MISSIONS = Topic(
    name="missions",
    kind=TopicKind.CELL,
    owner="planner",
    summary="the newest missions: objectives, subtasks, states, what their actions used when",
    payload=tasks.MissionsDocument,
    fields=(PackedField("document", "json", 262144),),
)
DEVICE_STATUS = Topic(
    name="device_status",
    kind=TopicKind.CELL,
    owner="executor",
    rate_hz=2,
    deadline_s=3.0,
    summary="each device of the home: on, off or unknown, how old that is and why, as JSON",
    payload=services.DevicesStatus,
    fields=(PackedField("document", "json", 32768),),
)
PLANNER_STATUS = Topic(
    name="planner_status",
    kind=TopicKind.CELL,
    owner="planner",
    rate_hz=2,
    deadline_s=2.0,
    summary="commands in work, what was asked, how each rung has been doing, as JSON",
    payload=tasks.PlannerStatus,
    fields=(PackedField("document", "json", 16384),),
)
HEARD = Topic(
    name="heard",
    kind=TopicKind.RING,
    owner="speech",
    summary="what was understood of each phrase: text, confidence, verdict and its reason",
    payload=speech.HeardMessage,
    slots=64,
    slot_bytes=8192,
)
SPEECH_STATUS = Topic(
    name="speech_status",
    kind=TopicKind.CELL,
    owner="speech",
    rate_hz=5,
    deadline_s=2.0,
    summary="whether the robot hears and speaks, why not, how well and how fast, as JSON",
    payload=speech.SpeechStatus,
    fields=(PackedField("document", "json", 8192),),
)
DASHBOARD_STATUS = Topic(
    name="dashboard_status",
    kind=TopicKind.CELL,
    owner="dashboard",
    rate_hz=2,
    deadline_s=3.0,
    summary="where the page is and who looks at it, as JSON",
    payload=services.DashboardStatus,
    fields=(PackedField("document", "json", 1024),),
)
STOP_DOOR_STATUS = Topic(
    name="stop_door_status",
    kind=TopicKind.CELL,
    owner="stop_door",
    rate_hz=2,
    deadline_s=3.0,
    summary="where the stop door listens and how often it was used, as JSON",
    payload=services.StopDoorStatus,
    fields=(PackedField("document", "json", 1024),),
)
ROS_STATUS = Topic(
    name="ros_status",
    kind=TopicKind.CELL,
    owner="ros",
    rate_hz=2,
    deadline_s=3.0,
    summary="the ROS 2 graph that the robot is in, what is under way for it, as JSON",
    payload=services.RosStatus,
    fields=(PackedField("document", "json", 4096),),
)
ROS_REQUEST = Topic(
    name="ros_request",
    kind=TopicKind.RING,
    owner="executor",
    summary="goals for servers beyond the robot, their cancels, and leave to drive",
    payload=services.RosGoalAct | Annotated[dict[str, Any], GoalRequest],
    slots=32,
    slot_bytes=65536,
)
ROS_ANSWER = Topic(
    name="ros_answer",
    kind=TopicKind.RING,
    owner="ros",
    summary="how a goal stands with its server: accepted, feedback, cancelling, how it ended",
    payload=Annotated[dict[str, Any], GoalAnswer],
    slots=64,
    slot_bytes=2048,
)
_DATED_VELOCITY: Final = (
    PackedField("v_m_s", "f8", unit="m/s"),
    PackedField("w_rad_s", "f8", unit="rad/s"),
    PackedField("valid_s", "f8", unit="s, then it is stale"),
    _LEFT,
)
REMOTE_BASE_COMMAND = Topic(
    name="remote_base_command",
    kind=TopicKind.CELL,
    owner="ros",
    rate_hz=20,
    deadline_s=0.25,
    summary="base velocity wanted from beyond the robot; control takes the youngest there is",
    fields=_DATED_VELOCITY,
)
HAND_BASE_COMMAND = Topic(
    name="hand_base_command",
    kind=TopicKind.CELL,
    owner="cli",
    rate_hz=20,
    deadline_s=0.25,
    summary="base velocity that a person asks for by keys or sticks; control takes the youngest",
    fields=_DATED_VELOCITY,
)
PAGE_SOUND = Topic(
    name="page_sound",
    kind=TopicKind.RECORD,
    owner="dashboard",
    summary="what a person says into a browser's microphone, and how their turn ends",
    slots=64,
    slot_bytes=8192,
    private=True,
)
TWIN_STATUS = Topic(
    name="twin_status",
    kind=TopicKind.CELL,
    owner="twin",
    rate_hz=2,
    deadline_s=3.0,
    summary="simulated time and how well it keeps pace with the wall clock, as JSON",
    payload=services.TwinStatusDocument,
    fields=(PackedField("document", "json", 1024),),
)
PROCESS_TABLE = Topic(
    name="process_table",
    kind=TopicKind.CELL,
    owner="supervisor",
    rate_hz=2,
    deadline_s=3.0,
    summary="state, pid, restarts, memory and CPU of every process, as JSON",
    payload=supervision.ProcessTable,
    fields=(PackedField("document", "json", 16384),),
)
ACTIVITY = Topic(
    name="activity",
    kind=TopicKind.CELL,
    owner="supervisor",
    rate_hz=2,
    deadline_s=3.0,
    summary="what the robot does in one word, and what stops it, as JSON; what changes, sooner",
    payload=supervision.ActivityDocument,
    fields=(PackedField("document", "json", 1024),),
)
RESOURCE_DIRECTIVES = Topic(
    name="resource_directives",
    kind=TopicKind.CELL,
    owner="supervisor",
    rate_hz=2,
    deadline_s=3.0,
    summary="what the budgets ask of each process: rate, model, suspension, as JSON",
    payload=supervision.ResourceDirectives,
    fields=(PackedField("document", "json", 4096),),
)
CLAIMS = Topic(
    name="claims",
    kind=TopicKind.CELL,
    owner="any",
    summary="who holds and who waits for which resource, as JSON; on change",
    payload=Annotated[dict[str, Any], Book],
    fields=(PackedField("document", "json", 8192),),
)
BUDGET = Topic(
    name="budget",
    kind=TopicKind.CELL,
    owner="supervisor",
    rate_hz=2,
    deadline_s=3.0,
    summary="every budget's line, the ladder, what is enforced how, as JSON",
    payload=supervision.BudgetDocument,
    fields=(PackedField("document", "json", 32768),),
)
BOARD = Topic(
    name="board",
    kind=TopicKind.CELL,
    owner="supervisor",
    rate_hz=2,
    deadline_s=3.0,
    summary="every reading of the computer by name, or why there is none, as JSON",
    payload=supervision.BoardDocument,
    fields=(PackedField("document", "json", 32768),),
)
BATTERY = Topic(
    name="battery",
    kind=TopicKind.CELL,
    owner="supervisor",
    rate_hz=2,
    deadline_s=5.0,
    summary="charge, voltage, current, whether it charges, or why that is not known, as JSON",
    payload=supervision.BatteryDocument,
    fields=(PackedField("document", "json", 2048),),
)
BUDGET_STOP = Topic(
    name="budget_stop",
    kind=TopicKind.CELL,
    owner="supervisor",
    rate_hz=2,
    deadline_s=3.0,
    summary="whether a budget demands that the robot stops, and why, as JSON; for control",
    payload=supervision.BudgetStop,
    fields=(PackedField("document", "json", 4096),),
)
PROFILE_REQUEST = Topic(
    name="profile_request",
    kind=TopicKind.RING,
    owner="any",
    summary="asks the supervisor for another profile: request id, name, permission to restart",
    payload=supervision.ProfileRequestMessage,
    slots=8,
    slot_bytes=2048,
)
PROFILE_CHANGE = Topic(
    name="profile_change",
    kind=TopicKind.RING,
    owner="supervisor",
    summary="phases of a profile change, for every process: prepare, commit, validate, ...",
    payload=supervision.ProfileChangeMessage,
    slots=16,
    slot_bytes=16384,
)
PROFILE_ANSWER = Topic(
    name="profile_answer",
    kind=TopicKind.RING,
    owner="any",
    summary="what each process says to a phase of a profile change",
    payload=supervision.ProfileAnswer,
    slots=64,
    slot_bytes=4096,
)
PROFILE_STATUS = Topic(
    name="profile_status",
    kind=TopicKind.CELL,
    owner="supervisor",
    rate_hz=2,
    deadline_s=3.0,
    summary="profile in force, phase of a change, how the last one ended, as JSON",
    payload=supervision.ProfileStatus,
    fields=(PackedField("document", "json", 4096),),
)

TOPICS: tuple[Topic[Any], ...] = tuple(one for one in globals().values() if isinstance(one, Topic))
BY_NAME: dict[str, Topic[Any]] = {topic.name: topic for topic in TOPICS}
