from pathlib import Path

import pytest

from vla_deploy.runtime.state_dir import (
    config_dir_of,
    engines_dir_of,
    models_dir_of,
    state_dir_of,
    user_base,
)


@pytest.mark.parametrize(
    ("base", "state"),
    [("/run/vla-deploy", "/var/log/vla-deploy"), ("/tmp/x/base", "/tmp/x/base-state")],
)
def test_what_outlives_a_run_lies_beside_a_chosen_runtime_directory(base, state):
    assert state_dir_of(Path(base)) == Path(state)


def test_a_users_runs_leave_it_in_the_users_state_directory(monkeypatch, tmp_path):
    monkeypatch.setenv("XDG_RUNTIME_DIR", "/run/user/1000")
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    assert state_dir_of(user_base()) == tmp_path / "vla-deploy"
    monkeypatch.delenv("XDG_STATE_HOME")
    monkeypatch.setenv("HOME", "/home/ann")
    assert state_dir_of(user_base()) == Path("/home/ann/.local/state/vla-deploy")


@pytest.mark.parametrize(
    ("base", "library"),
    [("/run/vla-deploy", "/var/lib/vla-deploy"), ("/tmp/x/base", "/tmp/x/base-state")],
)
def test_models_lie_where_the_service_may_keep_data(base, library):
    assert models_dir_of(Path(base)) == Path(library) / "models"
    assert engines_dir_of(Path(base)) == Path(library) / "engines"


def test_what_a_person_configures_lies_where_such_things_lie(monkeypatch, tmp_path):
    monkeypatch.setenv("XDG_RUNTIME_DIR", "/run/user/1000")
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))
    assert config_dir_of(user_base()) == tmp_path / "vla-deploy"
    assert config_dir_of(Path("/run/vla-deploy")) == Path("/etc/vla-deploy")
    assert config_dir_of(Path("/tmp/x/base")) == Path("/tmp/x/base-config")
