"""A job is recorded; any reader opens the file, and its replay drives the dashboard."""

import json
import signal
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from http.client import HTTPConnection
from pathlib import Path
from typing import Any, Final
from urllib.parse import urlsplit

import jsonschema_rs
import pytest
from mcap.reader import make_reader
from websockets.sync.client import connect

from sim_twin.harness.processes import ProcessStack
from vla_deploy.client.access.local_token import local_headers
from vla_deploy.telemetry.recording.recording_file import ALL_CHANNELS

pytestmark = [
    pytest.mark.gl,
    pytest.mark.stack,
    pytest.mark.slow,  # every day a flight is replayed in the browser
    pytest.mark.timeout(300),
    pytest.mark.twin(profile=str(Path(__file__).parents[1] / "coarse.toml")),
]

JOBS = [
    pytest.param("turn left, then look around", {"turn", "look_at"}, id="turn and look"),
    pytest.param("pick up the red cup and put it in the box", {"pick_up", "place"}, id="main job"),
]
SPEED = 8
# What nobody says while all goes well, and without ROS: stops, another profile, a replay, talk.
UNHEARD: Final = [
    "flight_event",
    "flight_request",
    "hand_base_command",
    "heard",
    "operator",
    "profile_answer",
    "profile_change",
    "profile_request",
    "remote_base_command",
    "replay_request",
    "replay_status",
    "ros_answer",
    "ros_request",
    "ros_status",
    "say",
    "voice_event",
]


@pytest.fixture
def recording(twin_stack: ProcessStack, tmp_path: Path, job: str) -> Path:
    """What the recorder has made of a job, in a folder of its own."""
    begun = json.loads(twin_stack.ask("record", "start", "--json").stdout)
    assert begun["state"] in ("beginning", "recording")
    outcome = twin_stack.say(job)
    assert outcome["success"], outcome
    assert json.loads(twin_stack.ask("record", "status", "--json").stdout)["lost"] == 0
    assert json.loads(twin_stack.ask("record", "stop", "--json").stdout)["state"] == "off"
    (made,) = json.loads(twin_stack.ask("record", "list", "--json").stdout)
    (file,) = twin_stack.base.parent.rglob(made["name"])
    kept: Path = file.rename(tmp_path / made["name"])
    twin_stack.close()  # a replay wants the cores for itself
    return kept


class Replay:
    """Run `vla-deploy replay` with its page, and look at the page's data."""

    def __init__(self, base: Path, file: Path) -> None:
        self.base = base
        command = [sys.executable, "-m", "vla_deploy.cli", "--runtime-base", str(base)]
        self.process = subprocess.Popen(
            [*command, "replay", str(file), "--speed", str(SPEED), "--pause"],
            stdout=subprocess.PIPE,
            text=True,
        )
        assert self.process.stdout is not None
        told = (line for line in self.process.stdout if line.startswith("dashboard: "))
        self.url = next(told).partition(" ")[2].partition("/#")[0].strip()

    def ask(self, method: str, path: str, body: Any = None) -> tuple[int, Any]:
        connection = HTTPConnection(urlsplit(self.url).netloc, timeout=20)
        headers = {"origin": self.url, "content-type": "application/json"}
        headers |= local_headers(self.base)
        connection.request(method, f"/api/v1/{path}", body and json.dumps(body), headers)
        with connection.getresponse() as answer:
            told = answer.status, json.load(answer)
        connection.close()
        return told

    def close(self) -> None:
        with self.process:  # which closes its pipe
            self.process.send_signal(signal.SIGINT)
            assert self.process.wait(30) == 0


@pytest.fixture
def replay(recording: Path) -> Iterator[Replay]:
    with tempfile.TemporaryDirectory(prefix="vla-") as folder:
        replay = Replay(Path(folder) / "base", recording)
        yield replay
        replay.close()


def validated(file: Path) -> dict[str, int]:
    """Count each channel's messages; every one of them fits the schema that the file declares."""
    with file.open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True)
        summary = reader.get_summary()
        assert summary is not None
        counts = {channel.topic: 0 for channel in summary.channels.values()}
        validators = {
            number: jsonschema_rs.validator_for(json.loads(schema.data))
            for number, schema in summary.schemas.items()
        }
        for schema, channel, message in reader.iter_messages():
            assert schema is not None
            validators[schema.id].validate(json.loads(message.data))
            counts[channel.topic] += 1
    return counts


class Watcher:
    """Gather what the page of a replay is sent until the file has ended."""

    def __init__(self, replay: Replay) -> None:
        self.states: set[str] = set()
        self.actions: list[tuple[str, str]] = []
        self.joints: list[list[float]] = []
        self.pictures = 0
        self.outcome: dict[str, Any] = {}
        address = urlsplit(replay.url)
        with connect(
            f"ws://{address.netloc}/api/v1/live",
            origin=replay.url,
            additional_headers=local_headers(replay.base),
        ) as live:
            live.send(json.dumps({"subscribe": [*self.takers, "camera", "replay_status"]}))
            live.recv()  # it stands until somebody watches it
            assert replay.ask("POST", "replay", {"act": "resume"}) == (200, {"asked": True})
            for message in live:
                if isinstance(message, bytes):
                    self.pictures += 1
                elif self._take(json.loads(message)):
                    break

    def _take(self, told: dict[str, Any]) -> bool:
        if told["topic"] in self.takers:
            self.takers[told["topic"]](self, told["data"])
        return told["topic"] == "replay_status" and told["data"]["state"] == "ended"

    def _control(self, data: dict[str, Any]) -> None:
        self.states.add(data["state"])

    def _task(self, data: dict[str, Any]) -> None:
        if data["event"] == "action":
            self.actions.append((data["skill"], data["status"]))
        elif data["event"] == "finished":
            self.outcome = data

    def _joints(self, data: dict[str, Any]) -> None:
        self.joints.append(data["position"])

    takers: Final = {"control_status": _control, "task_event": _task, "joint_state": _joints}


@pytest.mark.parametrize(("job", "skills"), JOBS)
def test_a_recorded_job_opens_anywhere_and_its_replay_drives_the_dashboard(
    recording: Path, replay: Replay, skills: set[str]
) -> None:
    counts = validated(recording)
    assert set(counts) == {channel.topic for channel in ALL_CHANNELS}
    assert sorted(topic for topic, count in counts.items() if count == 0) == UNHEARD

    seen = Watcher(replay)
    assert {(skill, "succeeded") for skill in skills} <= set(seen.actions), seen.actions
    assert seen.outcome["success"] is True
    assert "armed" in seen.states
    assert seen.pictures > 0
    assert any(max(angles) - min(angles) > 0.1 for angles in zip(*seen.joints, strict=True))
    _, state = replay.ask("GET", "state")
    assert state["replay"]["file"] == recording.name
    assert state["replay"]["unfit"] == 0
    status, refusal = replay.ask("POST", "commands", {"text": "go to the kitchen"})
    assert (status, refusal["error"]["code"]) == (409, "replay")
