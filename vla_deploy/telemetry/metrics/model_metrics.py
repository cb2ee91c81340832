"""Declare what is measured of planning, speech, perception, localisation and recording."""

from functools import partial
from typing import Final

from vla_deploy.client.place_state import PlaceState
from vla_deploy.telemetry.metrics.metric import Metric, count_of
from vla_deploy.telemetry.metrics.paths import at, each, keys, path, same

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
            f"vla_{name}_{percentile}_seconds",
            f"{text}, {percentile}.",
            at(f"{key}{percentile}_s"),
            topic=topic,
            kept=percentile == "p95",
        )
        for percentile in ("p50", "p95")
    ]


PLANNING: Final[tuple[Metric, ...]] = (
    _planner(
        "vla_planner_commands_total",
        "Commands that the planner heard, and what came of them, since it was started.",
        path(
            same("outcome", "heard", "planned", "refused", "asked", "failed"),
        ),
        kept=True,
    ),
    _planner(
        "vla_planner_waiting",
        "Commands that are being planned, wait, or wait for an answer.",
        at("commands"),
        take=count_of,
    ),
    _planner(
        "vla_planner_rung_attempts_total",
        "How often a rung of the planner's ladder was asked, by how that ended.",
        path(keys("by_rung"), each("rung"), same("outcome", *_OUTCOMES)),
    ),
    _planner(
        "vla_planner_rungs_away",
        "Rungs of the ladder that should plan and cannot.",
        at("away"),
        take=count_of,
    ),
    _executor(
        "vla_executor_state",
        "Whether the robot carries out commands: 1 for its state, 0 for the others.",
        at("state"),
        states=("idle", "executing", "recovering", "paused"),
    ),
)

HEARING: Final[tuple[Metric, ...]] = (
    _speech(
        "vla_speech_state",
        "What the ears are doing: 1 for their state, 0 for the others.",
        at("state"),
        states=("listening", "hearing", "transcribing", "deaf"),
    ),
    _speech(
        "vla_speech_phrases_total",
        "Phrases heard since speech was started, by what became of them.",
        path(keys("heard"), same("verdict", *VERDICTS)),
        kept=True,
    ),
    *_percentiles(
        *("speech_end_to_text", "speech_status", "heard.end_to_text_"),
        "From the end of a phrase to its words",
    ),
)

SEEING: Final[tuple[Metric, ...]] = (
    _scene(
        "vla_perception_sight",
        "How things are named, by the network or by form alone: 1 for the way in force.",
        at("sight.mode"),
        states=("network", "form"),
        state_label="mode",
    ),
    _scene(
        "vla_perception_inferences_total",
        "Runs of the detector's network since it was opened.",
        at(f"{_MODEL}.runs"),
        kept=True,
    ),
    _scene(
        "vla_perception_inference_failures_total",
        "Runs of the detector's network that failed.",
        at(f"{_MODEL}.failures"),
    ),
    _scene(
        "vla_perception_inference_busy_seconds_total",
        "Time of all runs of the detector's network.",
        at(f"{_MODEL}.busy_s"),
    ),
    *_percentiles(
        *("perception_inference", "scene", f"{_MODEL}."),
        "Time of a run of the detector's network",
    ),
    _scene(
        "vla_perception_images_refused_total",
        "Images that were too bad to be used.",
        at("image.refused"),
    ),
    _scene(
        "vla_perception_image_faults",
        "What is wrong with the last image.",
        at("image.faults"),
        take=count_of,
    ),
    _scene("vla_perception_things", "Things in the scene.", at("objects"), take=count_of),
    _scene("vla_perception_sensors_away", "Sensors that give nothing.", at("away"), take=count_of),
    _pose(
        "vla_place_state",
        "What the pose on the map is worth: 1 for its state, 0 for the others.",
        at("state"),
        states=tuple(state.name.lower() for state in PlaceState),
    ),
    _pose(
        "vla_place_match_ratio",
        "Share of the lidar's points that lie on the map.",
        at("match_ratio"),
        kept=True,
    ),
)

KEEPING: Final[tuple[Metric, ...]] = (
    _recorder(
        "vla_flight_recorder_held_bytes", "What the flight recorder remembers.", at("held_bytes")
    ),
    _recorder(
        "vla_flight_recorder_writing", "1 while the flight recorder writes a flight.", at("writing")
    ),
    _twin(
        "vla_twin_pace_ratio",
        "Simulated time over the time of the wall clock; in twin mode only.",
        at("real_time_factor"),
    ),
)

METRICS: Final = (*PLANNING, *HEARING, *SEEING, *KEEPING)
