import os
import select
import subprocess
import sys
from pathlib import Path

import pytest

from vla_deploy.supervisor.errors import RosNotFound
from vla_deploy.supervisor.processes.ros_environment import (
    PACKAGES,
    SYSTEM_PYTHON,
    VARIABLE,
    WORKSPACE_VARIABLE,
    find_environment,
    link_packages,
)

INHERITED = {"PATH": os.environ["PATH"], "HOME": "/home/robot", "PYTHONPATH": "/ours"}


def make_wheels(folder: Path) -> Path:
    """Lay out a virtual environment of the wheels; return its interpreter."""
    site = folder / "lib" / "python3.12" / "site-packages"
    site.mkdir(parents=True)
    (site / "ros_wheels_bootstrapper.pth").touch()
    (folder / "bin").mkdir()
    (folder / "bin" / "python").symlink_to(sys.executable)
    (folder / ".complete").touch()
    return folder / "bin" / "python"


def make_setup(file: Path, name: str) -> Path:
    """Write a setup script that sets what those of ROS set."""
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(
        f'export AMENT_PREFIX_PATH="/{name}${{AMENT_PREFIX_PATH:+:$AMENT_PREFIX_PATH}}"\n'
        f'export PYTHONPATH="/{name}/python${{PYTHONPATH:+:$PYTHONPATH}}"\n'
        "export ROS_DISTRO=jazzy\necho what it prints is none of the variables\n"
    )
    return file


@pytest.fixture
def find(tmp_path):
    """Find an environment on a computer that has nothing but what the test lays out."""

    def find_here(configured="", workspace="", **inherited):
        return find_environment(
            configured,
            workspace,
            inherited={**INHERITED, **inherited},
            places=(tmp_path / "checkout",),
            setup=tmp_path / "opt" / "setup.bash",
        )

    return find_here


@pytest.mark.parametrize(
    ("laid_out", "configured", "variable", "found"),
    [
        (("chosen", "other", "checkout/.venv-ros"), "chosen/bin/python", "other", "chosen"),
        (("chosen", "other", "checkout/.venv-ros"), "chosen", "other", "chosen"),
        (("other", "checkout/.venv-ros"), "", "other", "other"),
        (("checkout/.venv-ros",), "", "", "checkout/.venv-ros"),
    ],
)
def test_what_is_configured_goes_before_the_variable_before_wheels_before_the_systems_ros(
    tmp_path, find, laid_out, configured, variable, found
) -> None:
    make_setup(tmp_path / "opt" / "setup.bash", "jazzy")
    wheels = {folder: make_wheels(tmp_path / folder) for folder in laid_out}
    named = str(tmp_path / configured) if configured else ""
    environment = find(named, **({VARIABLE: str(tmp_path / variable)} if variable else {}))
    assert environment.python == wheels[found]
    assert ("the robot file" in environment.origin) == bool(configured)
    assert environment.variables["PYTHONPATH"] == environment.variables["AMENT_PREFIX_PATH"] == ""


def test_wheels_that_are_not_whole_are_passed_over(tmp_path, find) -> None:
    make_wheels(tmp_path / "checkout" / ".venv-ros")
    (tmp_path / "checkout" / ".venv-ros" / ".complete").unlink()
    make_setup(tmp_path / "opt" / "setup.bash", "jazzy")
    assert find().python == SYSTEM_PYTHON


def test_the_systems_ros_brings_the_variables_of_its_setup_script(tmp_path, find) -> None:
    make_setup(tmp_path / "opt" / "setup.bash", "jazzy")
    found = find(AMENT_PREFIX_PATH="/humble")
    assert found.variables == {
        "AMENT_PREFIX_PATH": "/jazzy",
        "PYTHONPATH": "/jazzy/python",
        "ROS_DISTRO": "jazzy",
    }
    assert str(tmp_path / "opt" / "setup.bash") in found.origin


def test_a_workspace_is_laid_over_the_systems_ros_even_where_wheels_are(tmp_path, find) -> None:
    make_wheels(tmp_path / "checkout" / ".venv-ros")
    make_setup(tmp_path / "opt" / "setup.bash", "jazzy")
    make_setup(tmp_path / "ws" / "install" / "setup.bash", "ws")
    for found in (
        find(workspace=str(tmp_path / "ws")),
        find(workspace=str(tmp_path / "ws" / "install")),
        find(**{WORKSPACE_VARIABLE: str(tmp_path / "ws")}),
    ):
        assert found.python == SYSTEM_PYTHON
        assert found.variables["PYTHONPATH"] == "/ws/python:/jazzy/python"


def test_an_interpreter_without_wheels_gets_the_systems_setup(tmp_path, find) -> None:
    make_setup(tmp_path / "opt" / "setup.bash", "jazzy")
    found = find(sys.executable)
    assert (found.python, found.variables["ROS_DISTRO"]) == (Path(sys.executable), "jazzy")


@pytest.mark.parametrize(
    ("configured", "workspace", "why"),
    [
        ("absent", "", "robot file names .*absent.* expected an interpreter"),
        ("folder", "", "robot file names .*folder.* expected an interpreter"),
        ("file", "", "robot file names .*file.* expected an interpreter"),
        ("", "folder", "colcon build"),
        ("wheels", "folder", "leave out one of"),
    ],
)
def test_what_is_named_but_cannot_be_used_is_refused(
    tmp_path, find, configured, workspace, why
) -> None:
    make_setup(tmp_path / "opt" / "setup.bash", "jazzy")
    make_wheels(tmp_path / "wheels")
    (tmp_path / "folder").mkdir()
    (tmp_path / "file").touch()
    names = [str(tmp_path / name) if name else "" for name in (configured, workspace)]
    with pytest.raises(RosNotFound, match=why):
        find(*names)


def test_a_setup_script_that_fails_is_told_in_its_own_words(tmp_path, find) -> None:
    setup = make_setup(tmp_path / "opt" / "setup.bash", "jazzy")
    setup.write_text("echo half of it is missing >&2; return 3\n")
    with pytest.raises(RosNotFound, match="half of it is missing"):
        find()


def test_where_nothing_is_found_all_that_was_looked_for_is_told(tmp_path, find) -> None:
    with pytest.raises(RosNotFound) as told:
        find()
    for words in (VARIABLE, str(tmp_path / "checkout" / ".venv-ros"), "setup.bash", "make ros"):
        assert words in str(told.value)


def test_links_show_our_packages_and_nothing_else_of_ours(tmp_path) -> None:
    (tmp_path / "drivers").symlink_to("/nowhere")
    for _ in range(2):
        folder = link_packages(tmp_path)
        assert {link.name for link in folder.iterdir()} == set(PACKAGES)
        assert all((link / "__init__.py").is_file() for link in folder.iterdir())
    code = f"import {', '.join(PACKAGES)}, importlib.util as u; assert not u.find_spec('numpy')"
    command = [sys.executable, "-S", "-c", code]
    subprocess.run(command, env={"PYTHONPATH": str(folder)}, check=True)


LAUNCHER = """
import os, subprocess, sys
command = "import ctypes, os, sys; ctypes.CDLL(None).prctl(1, 15, 0, 0, 0); "
command += "os.execv(sys.argv[1], sys.argv[1:])"
subprocess.Popen([sys.executable, "-I", "-S", "-c", command, *sys.argv[1:]])
sys.stdin.readline()
"""
CHILD = "import os, time; print(os.getpid(), flush=True); time.sleep(60)"


def test_the_kernels_signal_at_the_parents_end_outlives_the_restart_of_the_interpreter(
    ros_environment,
) -> None:
    """The wheels' interpreter executes itself anew, and is still told when the supervisor ends."""
    parent = subprocess.Popen(
        [sys.executable, "-c", LAUNCHER, ros_environment.python, "-c", CHILD],
        env={**os.environ, **ros_environment.variables},
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    assert parent.stdout is not None
    child = os.pidfd_open(int(parent.stdout.readline()))
    parent.kill()
    parent.communicate()
    ended, _, _ = select.select([child], [], [], 20)
    os.close(child)
    assert ended == [child]
