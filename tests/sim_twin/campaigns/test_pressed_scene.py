"""What the campaign lays out must be what the robot's own probes and profiles read."""

from functools import partial
from pathlib import Path

from drivers.clock import MonotonicClock
from platforms import load_profile
from platforms.probes import open_probes
from sim_twin.campaigns.pressing.pressed_scene import PROFILE, PressedScene
from sim_twin.campaigns.pressing.troubles import TROUBLES
from vla_deploy.supervisor.budgets.emergency import Emergencies, critical_trips_c


def scene_in(folder: Path) -> PressedScene:
    """Return a scene without a robot."""
    scene = PressedScene(MonotonicClock(), 0, small_disk=False, shifted_clock=False)
    scene.folder = folder
    scene.lay_out_board()
    return scene


def test_the_profile_is_valid_and_declares_every_step_that_a_trouble_expects(
    tmp_path: Path,
) -> None:
    path = tmp_path / "pressed.toml"
    path.write_text(PROFILE)
    profile = load_profile(str(path))
    declared = [" ".join(filter(None, (step.action, step.process))) for step in profile.ladder]
    for trouble in TROUBLES:
        places = [declared.index(step) for step in trouble.steps]
        assert places == sorted(places), trouble.name


def test_heat_and_brown_outs_reach_the_probes(tmp_path: Path) -> None:
    scene = scene_in(tmp_path)
    scene.disk.mkdir()
    probes = open_probes(scene.board, disk_folders=[scene.disk])
    emergencies = Emergencies(partial(critical_trips_c, scene.board))
    try:
        readings = probes.read()
        assert readings["temperature_c"].value == 45.0
        assert readings["disk_free_bytes"].value
        assert not emergencies.judge(readings)
        scene.heat(91.5)
        assert probes.read()["temperature_c"].value == 91.5
        scene.brown_out()
        assert "under-voltage" in emergencies.judge(probes.read())
        assert not emergencies.judge(probes.read())
        scene.heat(103.0)
        assert "the board goes off" in emergencies.judge(probes.read())
    finally:
        probes.close()
