"""Tell by what the camera is judged: its own word and the drawing, or what was measured of it."""

from collections.abc import Iterator

import numpy as np

from vla_deploy.doctor.context import DoctorContext
from vla_deploy.doctor.finding import DoctorFinding, ok, warn
from vla_deploy.robots.description import CameraMounting, LensCalibration


def camera_calibration(context: DoctorContext) -> Iterator[DoctorFinding]:
    """Return whether lens and mounting of the robot's camera were calibrated, and how well."""
    if context.robot is None:
        return
    name, camera = context.robot.name, context.robot.camera
    yield _lens(camera.lens, name)
    yield _mounting(camera.mounting, name)


def _lens(lens: LensCalibration | None, name: str) -> DoctorFinding:
    if lens is None:
        remedy = f"vla-deploy camera calibrate --robot {name}"
        return warn("camera lens", "as the camera itself tells it, never measured", remedy)
    error_px = lens.reprojection_error_px
    error = "error not told" if error_px is None else f"error {error_px:.2f} px"
    made_at = lens.made_at or "at a time not told"
    return ok("camera lens", f"calibrated {made_at}, f {lens.intrinsics.fx:.1f} px, {error}")


def _mounting(mounting: CameraMounting | None, name: str) -> DoctorFinding:
    if mounting is None:
        remedy = f"vla-deploy camera hand-eye --robot {name}"
        return warn("camera mounting", "as the MJCF draws it, never measured", remedy)
    shift_mm = 1000.0 * float(np.linalg.norm(mounting.translation_m))
    measured = f"calibrated {mounting.made_at}, {shift_mm:.1f} mm from where it is drawn"
    return ok("camera mounting", measured)
