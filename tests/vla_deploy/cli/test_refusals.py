"""What nobody should ask for is refused in one line that says why, with exit code 2."""

import shlex
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from vla_deploy.robots import load_robot

FLIGHT = Path(__file__).parents[1] / "telemetry" / "flights" / "estop_while_driving.mcap"

# The folder that a command runs in holds nothing, and no robot runs.
REFUSALS = [
    ("", "vla-deploy: the following arguments are required: COMMAND"),
    ("frobnicate", "vla-deploy: argument COMMAND: invalid choice"),
    ("say", "vla-deploy say: one of the arguments text --plan --answer is required"),
    ("say stop", "no robot runs in "),
    ("say --aloud --plan plan.json", "--aloud says a command in words"),
    ("say hello --voice en-us", "add --aloud"),
    ("say hello --snr 10", "add --aloud"),
    ("status", "no robot runs in "),
    ("shutdown", "no robot runs in "),
    ("fault list", "no robot runs"),
    ("person take red_cup", "no robot runs"),
    ("person put red_cup 1 2 far", "argument Z: expected metres from -50 to 50"),
    ("run --seed -1", "vla-deploy run: argument --seed: expected a whole number from 0"),
    ("run --twin --viewer --headless", "argument --headless: not allowed with argument --viewer"),
    ("run --viewer", "add --twin"),
    ("run --paced", "add --twin"),
    ("run --twin --robot nosuch", "expected a robot file"),
    ("run --twin --profile nosuch", "no profile 'nosuch'"),
    ("--runtime-base /dev/null/base run --twin", "choose another with --runtime-base"),
    ("demo --out /dev/null/out", "--out /dev/null/out: Not a directory"),
    ("bench nothing", "vla-deploy bench: argument benchmark: invalid choice"),
    ("check --robot nosuch", "expected a robot file, its folder, or one of butler"),
    ("check --profile nosuch", "no profile 'nosuch': choose "),
    ("check --plan /nowhere/plan.json", "cannot read the plan /nowhere/plan.json"),
    ("install --root /proc/self", "vla-deploy: /"),
    (f"uninstall --root {__file__}", "vla-deploy: /"),
    ("--runtime-base /proc/self/x profile use desktop", "vla-deploy: /"),
    ("validate soak --count 0", "argument --count: expected"),
    ("validate soak --count -1", "argument --count: expected"),
    ("validate soak --workers 0", "argument --workers: expected"),
    ("validate soak --workers x", "argument --workers: expected"),
    *((f"validate soak --hours {hours}", "argument --hours: expected")
      for hours in ("0", "-1", "nan", "inf")),
    ("robot urdf --out nowhere/it.urdf", "nowhere/it.urdf: No such file or directory"),
    ("robot urdf --robot nobody", "nobody: (file): got no such file, expected a robot file, its"),
    ("servo", "vla-deploy servo: the following arguments are required: SERVO_COMMAND"),
    ("servo set-id 253 1", "expected an id in 0..252, got '253'"),
    ("servo set-id 254 1 --family feetech", "feetech: expected an id in 0..253, got '254'"),
    ("servo set-id -- -1 1", "expected a whole number from 0, got '-1'"),
    ("servo scan --baud 12345", "argument --baud: invalid choice"),
    ("servo scan --ids 9-3", "expected the smaller id first, got '9-3'"),
    *((f"servo monitor --rate {rate}", f"--rate: expected 0.1 to 100, got '{rate}'")
      for rate in ("nan", "0", "fast")),
    ("servo monitor --count -1", "--count: expected a whole number from 1"),
    ("can scan", "--robot"),
    ("can monitor --robot butler --count 0", "--count: expected"),
    ("can monitor --robot butler --id 0xyz", "--id: expected"),
    ("can monitor --robot butler --node -1", "--node: expected"),
    ("can scan --interface socketcan", "needs --channel"),
    ("can scan --interface vla_hub --channel none", "start the twin first"),
    ("can monitor --interface slcan --channel /none", "see /dev/serial/by-id"),
    ("can scan --robot nobody", "nobody"),
    *((f"joint move head_pan {words}", "expected")
      for words in ("--to nan", "--by inf", "--to left", "--to 0 --speed 0")),
    ("models add x", "--onnx"),
    ("models add x --onnx f --size 640", "--size: expected"),
    ("models bench x --rounds 0", "--rounds: expected"),
    ("models quantise x --images d", "--labelled"),
    *((f"models quantise x --images d --labelled d --max-drop {drop}",
       "expected points from 0 to 100") for drop in ("nan", "-5", "inf", "much")),
    ("models show nothing", "no model 'nothing': expected one of"),
    (f"rerun {FLIGHT} --save {FLIGHT}", "expected a name that ends in .rrd"),
    ("rerun nobodys.mcap --save out.rrd", "no recording 'nobodys.mcap'"),
    ("rerun --without nothing_like_it --save out.rrd", "no topic matches"),
    ("rerun --save out.rrd", "no robot runs in"),
    ("map check gone.yaml", "gone.yaml: cannot read the map"),
    ("map convert a.yaml a.yaml", "choose another file"),
    (f"map show {load_robot('butler').home.map_path} --png noext", "ends in .png"),
    ("map record new.yaml --seconds 1", "no robot runs"),
    ("logs", "vla-deploy logs --last-run"),
    ("logs --last-run", "no run"),
    ("crashes show", "no process has crashed"),
    ("servers check nobody", "no server 'nobody': expected one that"),
]  # fmt: skip


@pytest.mark.parametrize(("words", "complaint"), REFUSALS, ids=[one for one, _ in REFUSALS])
def test_it_is_refused_in_one_line(
    vla: Callable[..., Any],
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
    words: str,
    complaint: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    try:
        code, _, error = vla(*shlex.split(words))
    except SystemExit as ended:  # of what the parser itself refuses
        code, error = ended.code, capsys.readouterr().err
    assert code == 2
    assert complaint in error
    assert error.count("\n") == 1
