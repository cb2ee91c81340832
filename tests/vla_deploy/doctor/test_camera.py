from dataclasses import replace

from vla_deploy.doctor.camera import camera_calibration
from vla_deploy.doctor.finding import FindingLevel
from vla_deploy.robots import load_robot
from vla_deploy.robots.description import CameraMounting, LensCalibration


def test_a_camera_that_was_never_measured_is_told_with_the_command(computer) -> None:
    findings = list(camera_calibration(computer.context(robot="butler")))
    assert [one.level for one in findings] == [FindingLevel.WARN, FindingLevel.WARN]
    assert [one.remedy.split()[2] for one in findings] == ["calibrate", "hand-eye"]
    assert list(camera_calibration(computer.context())) == []


def test_a_measured_camera_is_told_with_date_and_error(computer) -> None:
    robot = load_robot("butler")
    lens = LensCalibration(
        intrinsics=robot.camera.intrinsics,
        distortion_model="plumb_bob",
        reprojection_error_px=0.213,
        views=12,
        made_at="2026-11-22",
        tool="",
    )
    mounting = CameraMounting(
        site=robot.camera.site,
        model=robot.camera.model,
        focal_px=robot.camera.focal_px,
        translation_m=(0.003, 0.0, 0.004),
        quaternion_xyzw=(0.0, 0.0, 0.0, 1.0),
        residual_m=0.001,
        made_at="2026-11-22",
    )
    camera = replace(robot.camera, lens=lens, mounting=mounting)
    context = replace(computer.context(), robot=replace(robot, camera=camera))
    first, second = camera_calibration(context)
    assert (first.level, second.level) == (FindingLevel.OK, FindingLevel.OK)
    assert "2026-11-22" in first.measured
    assert "0.21 px" in first.measured
    assert "5.0 mm" in second.measured
