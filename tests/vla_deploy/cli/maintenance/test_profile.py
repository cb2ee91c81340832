import json
from functools import partial
from pathlib import Path
from types import SimpleNamespace

import pytest

from vla_deploy.cli.errors import CommandFailed
from vla_deploy.cli.maintenance import profile
from vla_deploy.cli.session import RobotSession
from vla_deploy.ipc import SharedSpace
from vla_deploy.supervisor.profiles.profile_choice import (
    ProfileChoice,
    StartProfile,
    choice_of,
    detect,
    start_profile,
)


@pytest.fixture
def vla(vla):
    return partial(vla, "profile")


@pytest.fixture
def mine(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text('inherits = "desktop"\nexecutor_rate_hz = 40\n')
    return str(path)


def test_list_names_every_profile_and_which_one_fits(vla):
    code, out, _ = vla("list", "--json")
    rows = {row["name"]: row for row in json.loads(out)}
    assert code == 0
    assert rows["jetson_orin_nano_8gb_super"]["inherits"] == [
        "jetson_orin_nano_8gb",
        "jetson_orin_nano",
        "jetson_base",
        "base",
    ]
    assert "fits this computer" in rows[detect()[0]]["note"]


def test_show_says_which_file_set_a_value(vla, mine):
    _, out, _ = vla("show", mine, "--provenance")
    (line,) = (line for line in out.splitlines() if line.startswith("executor_rate_hz"))
    assert line.split() == ["executor_rate_hz", "=", "40", mine]
    assert any(line.endswith("  base.toml") for line in out.splitlines())


def test_show_diff_tells_only_what_differs(vla, mine):
    assert vla("show", mine, "--diff", "desktop")[1] == "executor_rate_hz: 40   not 50\n"
    assert vla("show", mine, "--diff", mine)[1] == "no difference\n"


def test_validate_tells_every_fault_and_fails(vla, tmp_path):
    path = tmp_path / "bad.toml"
    path.write_text('inherits = "desktop"\ncolour = 1\nexecutor_rate_hz = 0\n')
    code, out, err = vla("validate", str(path))
    assert (code, out) == (2, "")
    assert "colour: unknown key" in err
    assert "executor_rate_hz: expected a number from 5 to 200 Hz, got 0" in err
    code, out, _ = vla("validate", str(path), "--json")
    assert (code, len(json.loads(out)["faults"])) == (2, 2)
    assert vla("validate", "desktop")[:2] == (0, "desktop: valid\n")


def test_a_chosen_profile_is_the_next_starts(vla, base, mine):
    assert start_profile(base).name == detect()[0]
    code, out, _ = vla("use", mine)
    assert (code, out) == (0, f"profile {mine}: kept for the next start; no robot runs\n")
    assert start_profile(base) == StartProfile(name=mine, why="chosen by: vla-deploy profile use")
    assert f"the next start takes {mine}" in vla("detect")[1]


@pytest.mark.parametrize(
    ("chosen", "words"),
    [
        ("of_a_later_release", "no profile 'of_a_later_release'"),
        ("/no/such/mine.toml", "No such file"),
        ("broken.toml", "executor_rate_hz: expected a number from 5 to 200 Hz, got 0"),
    ],
)
def test_a_chosen_profile_that_no_longer_loads_gives_way_to_the_detected_one(
    vla, base, tmp_path, monkeypatch, chosen, words
):
    monkeypatch.chdir(tmp_path)
    Path("broken.toml").write_text('inherits = "desktop"\nexecutor_rate_hz = 0\n')
    choice_of(base).save(chosen)
    start = start_profile(base)
    assert start.name == detect()[0]
    assert start.fault.startswith(f"the chosen profile {chosen} does not load: ")
    assert words in start.fault
    assert choice_of(base).load() == chosen  # it may come back
    assert start.fault in vla("detect")[1]


def test_root_chooses_for_the_service_whether_it_names_its_folder_or_not(monkeypatch):
    monkeypatch.setattr("os.getuid", lambda: 0)
    assert choice_of(None).path == choice_of(Path("/run/vla-deploy")).path
    assert choice_of(None).path == Path("/var/lib/vla-deploy/profile.json")


def test_a_dry_run_chooses_nothing(vla, base, mine):
    assert vla("use", mine, "--dry-run")[0] == 0
    assert choice_of(base).load() is None


@pytest.mark.parametrize("name", ["base", "jetson_base"])
def test_what_is_made_to_be_inherited_is_not_chosen(vla, base, name):
    code, _, err = vla("use", name)
    assert code != 0
    assert "made to be inherited, for no computer" in err
    assert choice_of(base).load() is None


def test_a_power_mode_that_this_computer_lacks_is_refused(vla, base, tmp_path):
    path = tmp_path / "fast.toml"
    path.write_text('inherits = "desktop"\npower_mode = "WARP"\n')
    code, _, err = vla("use", str(path))
    assert code == 2
    assert "power_mode: expected one of this board" in err
    assert choice_of(base).load() is None


@pytest.mark.parametrize("text", ["", "[]", '{"profile": 7}', '{"other": "x"}', "\xff"])
def test_an_unreadable_choice_counts_as_none(tmp_path, text):
    path = tmp_path / "profile.json"
    path.write_bytes(text.encode("latin-1"))
    assert ProfileChoice(path).load() is None


def test_an_unknown_computer_gets_desktop_and_the_reason(tmp_path):
    tree = tmp_path / "proc/device-tree"
    tree.mkdir(parents=True)
    (tree / "model").write_text("Toaster 3000\0")
    name, why = detect(tmp_path)
    assert name == "desktop"
    assert why.startswith("Toaster 3000 is not known: ")


@pytest.fixture
def ask(tmp_path, clock):
    """Ask a supervisor that tells, one after the other, some states of the change."""

    def ask(*states: dict) -> dict:
        space = SharedSpace(tmp_path / "ipc", clock)
        requests = space.ring_reader("profile_request", from_start=True)
        status = space.cell_writer("profile_status")
        told = list(states)
        request: dict = {}

        def tell() -> None:
            for event in requests.drain():
                request.update(event.payload)
            if told:
                state = told.pop(0)
                last = (
                    {"request_id": request["request_id"], **state["last"]} if state["last"] else {}
                )
                status.put_document({**state, "last": last})

        clock.after_wait = tell
        arguments = SimpleNamespace(allow_restart=True, dry_run=False, json=False)
        answer = profile._request(RobotSession(Path(tmp_path), clock), "calm", arguments)
        assert (request["profile"], request["allow_restart"]) == ("calm", True)
        return answer

    return ask


def test_use_follows_the_phases_until_its_own_request_has_ended(ask, capsys):
    phases = [{"phase": name, "last": {}} for name in ("prepare", "prepare", "watch")]
    answer = ask(*phases, {"phase": "", "last": {"outcome": "kept", "reason": ""}})
    assert answer["outcome"] == "kept"
    assert capsys.readouterr().out.splitlines() == [
        "every process prepares",
        "watching rates, late ticks and memory",
    ]


def test_a_supervisor_that_never_answers_is_told(ask):
    with pytest.raises(CommandFailed, match="the supervisor tells nothing of profile calm"):
        ask()


def test_use_warns_where_the_services_slice_is_too_small(vla, base, monkeypatch):
    monkeypatch.setattr(profile, "SERVICE_RUNTIME", base)
    monkeypatch.setattr(profile, "slice_too_small", lambda *_: "too small")
    code, _, error = vla("use", "desktop", "--dry-run")
    assert (code, error) == (0, "vla-deploy: too small\n")
