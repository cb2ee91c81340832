"""Declare what is measured of planning, speech, perception, localisation and recording."""

from typing import Final

from vla_deploy.navigation.place_judge import PlaceState
from vla_deploy.telemetry.metrics.metric import Metric, MetricKind, count_of
from vla_deploy.telemetry.metrics.paths import each, keys, same

_OUTCOMES: Final = ("planned", "asked", "declined", "refused", "invalid", "late")
# Not imported from speech: that would load its networks to count words.
VERDICTS: Final = ("accepted", "doubted", "rejected", "stop")
_MODEL: Final = "sight.model"


def _percentiles(name: str, topic: str, key: str, text: str) -> list[Metric]:
    """Declare median and 95 % of a latency, found in the document at `key` and their name."""
    return [
        Metric(
            name=f"vla_{name}_{percentile}_seconds",
            help=f"{text}, {percentile}.",
            topic=topic,
            paths=((keys(f"{key}{percentile}_s"),),),
            kept=percentile == "p95",
        )
        for percentile in ("p50", "p95")
    ]


PLANNING: Final[tuple[Metric, ...]] = (
    Metric(
        name="vla_planner_commands_total",
        kind=MetricKind.COUNTER,
        help="Commands that the planner heard, and what came of them, since it was started.",
        topic="planner_status",
        paths=((same("outcome", "heard", "planned", "refused", "asked", "failed"),),),
        kept=True,
    ),
    Metric(
        name="vla_planner_waiting",
        help="Commands that are being planned, wait, or wait for an answer.",
        topic="planner_status",
        paths=((keys("commands"),),),
        take=count_of,
    ),
    Metric(
        name="vla_planner_rung_attempts_total",
        kind=MetricKind.COUNTER,
        help="How often a rung of the planner's ladder was asked, by how that ended.",
        topic="planner_status",
        paths=((keys("by_rung"), each("rung"), same("outcome", *_OUTCOMES)),),
    ),
    Metric(
        name="vla_planner_rungs_away",
        help="Rungs of the ladder that should plan and cannot.",
        topic="planner_status",
        paths=((keys("away"),),),
        take=count_of,
    ),
    Metric(
        name="vla_executor_state",
        kind=MetricKind.STATES,
        help="Whether the robot carries out a command: 1 for its state, 0 for the other.",
        topic="executor_status",
        paths=((keys("state"),),),
        states=("idle", "executing"),
    ),
)

HEARING: Final[tuple[Metric, ...]] = (
    Metric(
        name="vla_speech_state",
        kind=MetricKind.STATES,
        help="What the ears are doing: 1 for their state, 0 for the others.",
        topic="speech_status",
        paths=((keys("state"),),),
        states=("listening", "hearing", "transcribing", "deaf"),
    ),
    Metric(
        name="vla_speech_phrases_total",
        kind=MetricKind.COUNTER,
        help="Phrases heard since speech was started, by what became of them.",
        topic="speech_status",
        paths=((keys("heard"), same("verdict", *VERDICTS)),),
        kept=True,
    ),
    *_percentiles(
        *("speech_end_to_text", "speech_status", "heard.end_to_text_"),
        "From the end of a phrase to its words",
    ),
)

SEEING: Final[tuple[Metric, ...]] = (
    Metric(
        name="vla_perception_sight",
        kind=MetricKind.STATES,
        help="How things are named, by the network or by form alone: 1 for the way in force.",
        topic="scene",
        paths=((keys("sight.mode"),),),
        states=("network", "form"),
        state_label="mode",
    ),
    Metric(
        name="vla_perception_inferences_total",
        kind=MetricKind.COUNTER,
        help="Runs of the detector's network since it was opened.",
        topic="scene",
        paths=((keys(f"{_MODEL}.runs"),),),
        kept=True,
    ),
    Metric(
        name="vla_perception_inference_failures_total",
        kind=MetricKind.COUNTER,
        help="Runs of the detector's network that failed.",
        topic="scene",
        paths=((keys(f"{_MODEL}.failures"),),),
    ),
    Metric(
        name="vla_perception_inference_busy_seconds_total",
        kind=MetricKind.COUNTER,
        help="Time of all runs of the detector's network.",
        topic="scene",
        paths=((keys(f"{_MODEL}.busy_s"),),),
    ),
    *_percentiles(
        *("perception_inference", "scene", f"{_MODEL}."),
        "Time of a run of the detector's network",
    ),
    Metric(
        name="vla_perception_images_refused_total",
        kind=MetricKind.COUNTER,
        help="Images that were too bad to be used.",
        topic="scene",
        paths=((keys("image.refused"),),),
    ),
    Metric(
        name="vla_perception_image_faults",
        help="What is wrong with the last image.",
        topic="scene",
        paths=((keys("image.faults"),),),
        take=count_of,
    ),
    Metric(
        name="vla_perception_things",
        help="Things in the scene.",
        topic="scene",
        paths=((keys("objects"),),),
        take=count_of,
    ),
    Metric(
        name="vla_perception_sensors_away",
        help="Sensors that give nothing.",
        topic="scene",
        paths=((keys("away"),),),
        take=count_of,
    ),
    Metric(
        name="vla_place_state",
        kind=MetricKind.STATES,
        help="What the pose on the map is worth: 1 for its state, 0 for the others.",
        topic="pose",
        paths=((keys("state"),),),
        states=tuple(state.name.lower() for state in PlaceState),
    ),
    Metric(
        name="vla_place_match_ratio",
        help="Share of the lidar's points that lie on the map.",
        topic="pose",
        paths=((keys("match_ratio"),),),
        kept=True,
    ),
)

KEEPING: Final[tuple[Metric, ...]] = (
    Metric(
        name="vla_flight_recorder_held_bytes",
        help="What the flight recorder remembers.",
        topic="recorder_status",
        paths=((keys("held_bytes"),),),
    ),
    Metric(
        name="vla_flight_recorder_writing",
        help="1 while the flight recorder writes a flight.",
        topic="recorder_status",
        paths=((keys("writing"),),),
    ),
    Metric(
        name="vla_twin_pace_ratio",
        help="Simulated time over the time of the wall clock; in twin mode only.",
        topic="twin_status",
        paths=((keys("real_time_factor"),),),
    ),
)

METRICS: Final = (*PLANNING, *HEARING, *SEEING, *KEEPING)
