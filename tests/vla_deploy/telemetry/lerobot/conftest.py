"""Write small datasets and recordings."""

import base64
import json
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from drivers.clock import NS_PER_S
from vla_deploy.telemetry.channels import IMAGE_SCHEMA, Channel
from vla_deploy.telemetry.mcap_file import RECORDING, McapFile
from vla_deploy.telemetry.recorded_file import RecordedFile, read_file

WALL_OFFSET_NS = 1_800_000_000 * NS_PER_S
CHANNELS = ("joint_state", "utterance", "task_event", "rgbd/colour")
JOINTS = 6


@pytest.fixture
def needs_arrow() -> None:
    for module in ("pyarrow", "av"):
        pytest.importorskip(module, reason="LeRobot datasets need the extra: vla-deploy[lerobot]")


def joints_at(at_s: float, count: int = JOINTS) -> dict[str, Any]:
    """Return a joint_state in which everything moves at 0.1 rad/s, setpoints ahead of it."""
    position = [round(0.1 * at_s + 0.01 * i, 6) for i in range(count)] + [0.0] * (32 - count)
    return {
        "joint_count": count,
        "position": position,
        "setpoint": [value + 0.02 for value in position],
    }


def image_of(level: int, width: int = 64, height: int = 48) -> dict[str, Any]:
    pixels = np.full((height, width, 3), level, np.uint8)
    pixels[:, : width // 4] = (0, 0, 255)  # OpenCV's red
    _, data = cv2.imencode(".jpg", pixels, [cv2.IMWRITE_JPEG_QUALITY, 95])
    return {"data": base64.b64encode(data.tobytes()).decode(), "format": "jpeg"}


def spoken(command: str, text: str, from_s: float, to_s: float, success: bool = True) -> list[Any]:
    """Return the messages of a command that is given a second before its first action."""
    told = {"command_id": command}
    return [
        (from_s - 1.0, "utterance", {**told, "text": text}),
        (from_s, "task_event", {**told, "event": "action"}),
        (to_s, "task_event", {**told, "event": "finished", "success": success}),
    ]


@pytest.fixture
def recording(tmp_path: Path) -> Callable[..., RecordedFile]:
    """Write a recording of messages (s, channel, document), in the order of time."""

    def write(
        messages: Iterable[tuple[float, str, dict[str, Any]]],
        *,
        robot: str = "so101",
        name: str = "run",
    ) -> RecordedFile:
        path = tmp_path / f"{name}.mcap"
        head = {"run_id": "r", "robot": robot, "profile": "desktop", "vla_deploy": "0"}
        channels = [Channel(topic=one, schema_name=IMAGE_SCHEMA, schema={}) for one in CHANNELS]
        with path.open("wb") as stream:
            mcap = McapFile(
                stream, channels, RECORDING, {**head, "wall_offset_ns": str(WALL_OFFSET_NS)}
            )
            for at_s, channel, document in sorted(messages, key=lambda one: one[0]):
                stamp_ns = WALL_OFFSET_NS + round(at_s * NS_PER_S)
                mcap.add(channel, stamp_ns, json.dumps(document).encode())
            mcap.finish()
        return read_file(path)

    return write
