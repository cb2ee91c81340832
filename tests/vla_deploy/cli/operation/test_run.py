"""What `run` ends with tells the service manager whether another try may help."""

from functools import partial
from pathlib import Path

import pytest

from vla_deploy.cli.main import main
from vla_deploy.cli.operation import run
from vla_deploy.supervisor.supervisor import Supervisor
from vla_deploy.supervisor.table import ProcessSpec, RestartPolicy

pytestmark = pytest.mark.stack
ONCE_MORE = RestartPolicy(initial_s=0.05, max_restarts=1)


@pytest.mark.parametrize(("child_code", "code"), [(1, 1), (2, 2), (4, 4)])
def test_run_tells_whether_another_try_may_help(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    child_code: int,
    code: int,
) -> None:
    script = f"import sys; print('servos: no such port', file=sys.stderr); sys.exit({child_code})"
    # It never says that it is ready: one that only ran would be, if it took long to end.
    row = ProcessSpec(
        name="control", command=("-c", script), ready_topic="joint_state", restart=ONCE_MORE
    )
    monkeypatch.setattr(run, "Supervisor", partial(Supervisor, table=(row,)))
    base = str(tmp_path / "base")
    assert main(["--runtime-base", base, "run", "--profile", "desktop"]) == code
    assert "vla-deploy: control did not start: " in capsys.readouterr().err
