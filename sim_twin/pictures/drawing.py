"""Name the processes that draw what the twin does: the camera with the film, and the window."""

import os
from collections.abc import Mapping
from pathlib import Path

from sim_twin.errors import DrawingFailed
from sim_twin.pictures.mirror_link import MirrorLink

DISPLAY_VARIABLES = ("DISPLAY", "WAYLAND_DISPLAY")


def start_camera(
    robot: str, world: str, seed: int, devices_dir: Path, *, is_member: bool
) -> MirrorLink:
    """Start the process that renders the camera's frames and films, and wait for it.

    `is_member` lets the twin's time wait for its frames.

    Raises:
        DrawingFailed: it cannot render here, or does not start.
    """
    arguments = {
        "--robot": robot,
        "--world": world,
        "--seed": str(seed),
        "--devices-dir": str(devices_dir),
    }
    # One llvmpipe thread draws as fast as two and leaves the other core to the robot.
    environment = {"LP_NUM_THREADS": "1"}
    flags = ["--member"] if is_member else []
    return _ready(
        MirrorLink("camera", "sim_twin.pictures.camera_process", arguments, environment, flags)
    )


def start_viewer(robot: str, world: str, environ: Mapping[str, str] = os.environ) -> MirrorLink:
    """Open a window on the twin, and wait for it.

    Raises:
        DrawingFailed: there is no display, or the window does not open.
    """
    if not any(environ.get(name) for name in DISPLAY_VARIABLES):
        raise DrawingFailed(
            f"no window: there is no display ({' and '.join(DISPLAY_VARIABLES)} are not set); "
            "run on a desktop or through ssh -X, or leave --viewer out"
        )
    arguments = {"--robot": robot, "--world": world}
    return _ready(MirrorLink("window", "sim_twin.pictures.viewer_process", arguments))


def _ready(link: MirrorLink) -> MirrorLink:
    try:
        link.wait_ready()
    except BaseException:
        link.close()
        raise
    return link
