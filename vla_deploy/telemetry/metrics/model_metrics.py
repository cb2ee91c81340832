"""Declare what is measured of planning, speech, perception, localisation and recording."""

from functools import partial
from typing import Final

from vla_deploy.navigation.place_judge import PlaceState
from vla_deploy.telemetry.metrics.metric import Metric, count_of
from vla_deploy.telemetry.metrics.paths import each, keys, same

_planner = partial(Metric, topic="planner_status")
_executor = partial(Metric, topic="executor_status")
_speech = partial(Metric, topic="speech_status")
_scene = partial(Metric, topic="scene")
_pose = partial(Metric, topic="pose")
_recorder = partial(Metric, topic="recorder_status")
_twin = partial(Metric, topic="twin_status")
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
    _planner(
        name="vla_planner_commands_total",
        help="Commands that the planner heard, and what came of them, since it was started.",
        paths=((same("outcome", "heard", "planned", "refused", "asked", "failed"),),),
        kept=True,
    ),
    _planner(
        name="vla_planner_waiting",
        help="Commands that are being planned, wait, or wait for an answer.",
        paths=((keys("commands"),),),
        take=count_of,
    ),
    _planner(
        name="vla_planner_rung_attempts_total",
        help="How often a rung of the planner's ladder was asked, by how that ended.",
        paths=((keys("by_rung"), each("rung"), same("outcome", *_OUTCOMES)),),
    ),
    _planner(
        name="vla_planner_rungs_away",
        help="Rungs of the ladder that should plan and cannot.",
        paths=((keys("away"),),),
        take=count_of,
    ),
    _executor(
        name="vla_executor_state",
        help="Whether the robot carries out a command: 1 for its state, 0 for the other.",
        paths=((keys("state"),),),
        states=("idle", "executing"),
    ),
)

HEARING: Final[tuple[Metric, ...]] = (
    _speech(
        name="vla_speech_state",
        help="What the ears are doing: 1 for their state, 0 for the others.",
        paths=((keys("state"),),),
        states=("listening", "hearing", "transcribing", "deaf"),
    ),
    _speech(
        name="vla_speech_phrases_total",
        help="Phrases heard since speech was started, by what became of them.",
        paths=((keys("heard"), same("verdict", *VERDICTS)),),
        kept=True,
    ),
    *_percentiles(
        *("speech_end_to_text", "speech_status", "heard.end_to_text_"),
        "From the end of a phrase to its words",
    ),
)

SEEING: Final[tuple[Metric, ...]] = (
    _scene(
        name="vla_perception_sight",
        help="How things are named, by the network or by form alone: 1 for the way in force.",
        paths=((keys("sight.mode"),),),
        states=("network", "form"),
        state_label="mode",
    ),
    _scene(
        name="vla_perception_inferences_total",
        help="Runs of the detector's network since it was opened.",
        paths=((keys(f"{_MODEL}.runs"),),),
        kept=True,
    ),
    _scene(
        name="vla_perception_inference_failures_total",
        help="Runs of the detector's network that failed.",
        paths=((keys(f"{_MODEL}.failures"),),),
    ),
    _scene(
        name="vla_perception_inference_busy_seconds_total",
        help="Time of all runs of the detector's network.",
        paths=((keys(f"{_MODEL}.busy_s"),),),
    ),
    *_percentiles(
        *("perception_inference", "scene", f"{_MODEL}."),
        "Time of a run of the detector's network",
    ),
    _scene(
        name="vla_perception_images_refused_total",
        help="Images that were too bad to be used.",
        paths=((keys("image.refused"),),),
    ),
    _scene(
        name="vla_perception_image_faults",
        help="What is wrong with the last image.",
        paths=((keys("image.faults"),),),
        take=count_of,
    ),
    _scene(
        name="vla_perception_things",
        help="Things in the scene.",
        paths=((keys("objects"),),),
        take=count_of,
    ),
    _scene(
        name="vla_perception_sensors_away",
        help="Sensors that give nothing.",
        paths=((keys("away"),),),
        take=count_of,
    ),
    _pose(
        name="vla_place_state",
        help="What the pose on the map is worth: 1 for its state, 0 for the others.",
        paths=((keys("state"),),),
        states=tuple(state.name.lower() for state in PlaceState),
    ),
    _pose(
        name="vla_place_match_ratio",
        help="Share of the lidar's points that lie on the map.",
        paths=((keys("match_ratio"),),),
        kept=True,
    ),
)

KEEPING: Final[tuple[Metric, ...]] = (
    _recorder(
        name="vla_flight_recorder_held_bytes",
        help="What the flight recorder remembers.",
        paths=((keys("held_bytes"),),),
    ),
    _recorder(
        name="vla_flight_recorder_writing",
        help="1 while the flight recorder writes a flight.",
        paths=((keys("writing"),),),
    ),
    _twin(
        name="vla_twin_pace_ratio",
        help="Simulated time over the time of the wall clock; in twin mode only.",
        paths=((keys("real_time_factor"),),),
    ),
)

METRICS: Final = (*PLANNING, *HEARING, *SEEING, *KEEPING)
