"""Give the command line what nobody should, and read what it says; nothing is started here."""

import argparse
import errno
import json
import subprocess
import sys
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path

import pytest

from vla_deploy.cli.commands import COMMANDS, emit
from vla_deploy.cli.errors import USER_ERRORS
from vla_deploy.cli.main import main, parser
from vla_deploy.cli.operation import demo

BUTLER = Path(demo.__file__).parents[2] / "robots" / "butler"
CYCLE = {
    "goal": "wait for ever",
    "actions": [
        {"id": "a", "skill": "wait", "parameters": {"duration_s": 1}, "depends_on": ["b"]},
        {"id": "b", "skill": "wait", "parameters": {"duration_s": 1}, "depends_on": ["a"]},
    ],
}
TEN_FAULTS = {
    "baud = 3000000": "baud = -1",
    "protocol = 2": "protocol = 1",
    'joint = "left_elbow", sign = 1': 'joint = "left_elbow", sign = 3',
    'id = 2, model = "XM540-W270"': 'id = 1, model = "XM540-W270"',
    'id = 4, model = "XM430-W350"': 'id = 4, model = "XM999"',
    'joint = "left_wrist_roll"': 'joint = "left_wing"',
    "wheel_radius_m = 0.08": "wheel_radius_m = 0.0",
    "track_m = 0.34": 'track_m = "wide"',
    "node_id = 2": "node_id = 200",
    "bitrate = 1000000": "bitrate = 0",
}


def commands() -> dict[str, argparse.ArgumentParser]:
    (sub,) = (one for one in parser()._actions if isinstance(one, argparse._SubParsersAction))
    return sub.choices


def every_parser(parser: argparse.ArgumentParser) -> Iterator[argparse.ArgumentParser]:
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            for one in action.choices.values():
                yield one
                yield from every_parser(one)


@pytest.mark.parametrize(
    "command", [pytest.param(one, id=one.prog) for one in every_parser(parser())]
)
def test_the_help_of_every_command_ends_with_an_example(command):
    assert f"  {command.prog}" in command.format_help().split("examples:")[1]


def test_the_list_of_commands_tells_of_each_what_it_tells_of_itself():
    assert parser([]).format_help() == parser().format_help()
    assert list(commands()) == list(COMMANDS)


def test_no_command_loads_what_only_others_need():
    spell = "import sys; from vla_deploy.cli.main import main, parser; "
    spell += "parser(['--help']), parser(['status']), parser(['estop']); "
    spell += "print(*{'can', 'cv2', 'pinocchio', 'pydantic'} & sys.modules.keys()); "
    spell += "main(['--runtime-base', '/nonexistent/base', 'servers', 'list']); "
    spell += "print('httpcore2' in sys.modules)"
    told = subprocess.run([sys.executable, "-c", spell], capture_output=True, text=True)
    assert (told.stdout.splitlines()[0], told.stdout.splitlines()[-1]) == ("", "False")
    assert told.stderr == ""


def test_a_folder_named_like_a_command_is_a_folder(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(["--runtime-base", "run", "estop"]) == 2
    assert "no robot runs in run;" in capsys.readouterr().err


@pytest.mark.parametrize(("module", "name"), USER_ERRORS.items())
def test_what_a_person_can_mend_is_an_exception_of_that_module(module, name):
    assert issubclass(getattr(import_module(module), name), Exception)


SHARED = {
    "robot": "my_folder", "profile": "jetson_orin_nano", "world": "flat", "seed": 7,
    "twin": True, "paced": True,
}  # fmt: skip


@pytest.mark.parametrize("command", ["run", "demo"])
@pytest.mark.parametrize("window", ["headless", "viewer"])
def test_run_and_demo_take_the_same_words_about_the_twin(command, window):
    values = {word: value for word, value in SHARED.items() if value is not True}
    words = [word for name, value in values.items() for word in (f"--{name}", str(value))]
    taken = vars(
        parser([command]).parse_args([command, *words, "--twin", "--paced", f"--{window}"])
    )
    assert SHARED.items() <= taken.items()
    assert (taken["headless"], taken["viewer"]) == (window == "headless", window == "viewer")


def plan_file(tmp_path: Path, content: str) -> str:
    path = tmp_path / "plan.json"
    path.write_text(content)
    return str(path)


@pytest.mark.parametrize(
    ("content", "complaint"),
    [
        (json.dumps(CYCLE), "the dependencies form a cycle: a -> b -> a"),
        ("not json", "is no JSON"),
        ('{"goal": "x", "actions": [{"id": "a", "skill": "fly"}]}', 'unknown skill "fly"'),
        ('{"goal": "x", "actions": []}', "no actions"),
    ],
)
def test_a_bad_plan_is_one_line_and_exit_code_2(content, complaint, tmp_path, capsys):
    assert main(["check", "--plan", plan_file(tmp_path, content)]) == 2
    error = capsys.readouterr().err
    assert complaint in error
    assert error.count("\n") == 1


def test_all_ten_faults_of_a_robot_file_are_told_at_once(tmp_path, capsys):
    text = (BUTLER / "robot.toml").read_text()
    for right, wrong in TEN_FAULTS.items():
        assert right in text
        text = text.replace(right, wrong, 1)
    text = text.replace('mjcf = "', f'mjcf = "{BUTLER}/')
    (tmp_path / "robot.toml").write_text(text)
    assert main(["run", "--twin", "--robot", str(tmp_path)]) == 2
    first, *faults = capsys.readouterr().err.splitlines()
    assert first.startswith("vla-deploy: ")
    told = "\n".join(faults)
    for word in ("baud", "protocol", "sign", "XM999", "left_wing", "wheel_radius_m", "track_m"):
        assert word in told
    for word in ("node_id", "bitrate", "id"):
        assert word in told
    assert len(faults) >= len(TEN_FAULTS)


def test_a_reader_that_has_seen_enough_gets_no_traceback():
    pipe = subprocess.PIPE
    words = [sys.executable, "-m", "vla_deploy.cli.main", "schema"]
    with subprocess.Popen(words, stdout=pipe, stderr=pipe, text=True) as process:
        process.stdout.close()
        assert process.stderr.read() == ""
    assert process.returncode == 141


def test_a_runtime_directory_of_someone_else_is_one_line_and_exit_code_2(
    tmp_path, capsys, monkeypatch
):
    def forbid(*_: object, **__: object) -> str:
        raise PermissionError(errno.EACCES, "Permission denied")

    monkeypatch.setattr(Path, "read_text", forbid)
    assert main(["--runtime-base", str(tmp_path), "status"]) == 2
    error = capsys.readouterr().err
    assert f"runtime directory {tmp_path}: Permission denied; choose another" in error
    assert error.count("\n") == 1


def test_the_service_tries_again_after_a_fault_of_the_system(capsys, monkeypatch):
    def fill_up(*_: object) -> int:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr("vla_deploy.cli.operation.run.main", fill_up)
    assert main(["run", "--twin"]) == 1
    assert capsys.readouterr().err == "vla-deploy: [Errno 28] No space left on device\n"


def test_a_document_is_printed_even_where_no_text_can_be_made_of_it(capsys):
    assert emit(argparse.Namespace(json=True), {"state": 7}, lambda: 1 // 0) == 0
    assert json.loads(capsys.readouterr().out) == {"state": 7}
