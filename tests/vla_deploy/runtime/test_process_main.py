import signal
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.stack

NODE = """
import sys
from pathlib import Path
from drivers import errors
from vla_deploy.inference.errors import InferenceError, ModelFileSpoiled
from vla_deploy.runtime.process_main import main

TROUBLES = {kind.__name__: kind for kind in errors.DriverError.__subclasses__()}

class Node:
    period_s = 0.01
    def __init__(self, context):
        self.context, self.steps = context, 0
    def start(self):
        if self.context.robot == "blind":
            raise ModelFileSpoiled("detector.onnx: it was cut off; add it again")
        if self.context.robot in TROUBLES:
            raise TROUBLES[self.context.robot]("servos: /dev/ttyUSB0 does not exist; plug it in")
        print("start", self.context.devices_dir, Path("/proc/self/comm").read_text().strip())
    def step(self):
        self.steps += 1
        if self.context.robot == "buggy":
            raise KeyError("elbow")
        if self.steps == 3:
            print("three steps", flush=True)
    def stop(self):
        print("stop", flush=True)

sys.exit(main("planner", Node, mendable=(InferenceError,)))
"""


def arguments(tmp_path: Path, robot: str, profile: str = "desktop") -> list[str]:
    options = ["--run-dir", str(tmp_path), "--robot", robot, "--profile", profile]
    return [sys.executable, "-c", NODE, *options]


def run(tmp_path: Path, robot: str, profile: str = "desktop") -> subprocess.CompletedProcess:
    command = arguments(tmp_path, robot, profile)
    return subprocess.run(command, capture_output=True, text=True, timeout=30, check=False)


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_a_stop_signal_ends_the_node_in_order(tmp_path, number):
    command = [*arguments(tmp_path, "any"), "--devices-dir", "/devices"]
    ready_file = tmp_path / "ready" / "planner"
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout.readline() == "start /devices vla-planner\n"
        assert process.stdout.readline() == "three steps\n"
        assert ready_file.read_text() == f"{process.pid}\n"
        process.send_signal(number)
        assert process.stdout.read() == "stop\n"
    assert process.returncode == 0
    assert not ready_file.exists()


@pytest.mark.parametrize("trouble", ["DeviceMissing", "DeviceBusy", "LinkLost", "NoReply"])
def test_an_absent_device_is_one_line_and_an_exit_code_of_its_own(tmp_path, trouble):
    done = run(tmp_path, trouble)
    assert done.returncode == 4
    assert done.stderr == ("planner: ERROR: servos: /dev/ttyUSB0 does not exist; plug it in\n")
    assert not (tmp_path / "ready" / "planner").exists()


@pytest.mark.parametrize("trouble", ["WrongDevice", "DeviceFault", "UnknownModel"])
def test_a_device_that_a_person_must_mend_is_exit_code_2(tmp_path, trouble):
    assert run(tmp_path, trouble).returncode == 2


def test_a_model_that_is_required_and_spoiled_is_one_line_and_exit_code_2(tmp_path):
    done = run(tmp_path, "blind")
    assert done.returncode == 2
    assert done.stderr == "planner: ERROR: detector.onnx: it was cut off; add it again\n"


def test_an_unknown_profile_is_one_line_and_exit_code_2(tmp_path):
    done = run(tmp_path, "any", "deskop")
    assert done.returncode == 2
    assert done.stderr.startswith("planner: ERROR: no profile 'deskop'")
    assert done.stderr.count("\n") == 1


def test_a_missing_run_directory_is_exit_code_2(tmp_path):
    done = run(tmp_path / "gone", "any")
    assert done.returncode == 2
    assert "gone: no such directory; is the run still up?" in done.stderr


def test_a_crash_stops_the_node_and_leaves_its_trace_in_the_log(tmp_path):
    done = run(tmp_path, "buggy")
    assert done.returncode == 1
    assert done.stdout.endswith("stop\n")
    assert "planner: ERROR: crashed\nTraceback" in done.stderr
    assert "KeyError: 'elbow'" in done.stderr
