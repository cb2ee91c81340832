"""Judge the recorded example flights again; `make_flights.py` records them anew."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from vla_deploy.cli.main import main
from vla_deploy.ipc.memory.delta import DeltaReader, DeltaWriter
from vla_deploy.ipc.memory.packing import Catalogue
from vla_deploy.telemetry import judge
from vla_deploy.telemetry.channels import TICKS, tick_bytes
from vla_deploy.telemetry.errors import FlightForeign
from vla_deploy.telemetry.judge import JUDGED_TYPES, judge_again
from vla_deploy.telemetry.recorded_file import read_flight

FLIGHTS = sorted((Path(__file__).parent / "flights").glob("*.mcap"))
DRIVING = FLIGHTS[0].with_name("estop_while_driving.mcap")
CAUSES = {
    "estop_while_driving": "estop",
    "servo_bus_unplugged": "servo_bus_lost",
    "wheel_blocked": "wheel_following_error",
    "zone_entered_and_left": "obstacle_stop_zone",
    "arm_blocked": "collision",
    "arm_into_body": "self_collision",
}


def records(path: Path) -> list[bytes]:
    return [tick_bytes(message.text) for message in read_flight(path).messages(TICKS)]


def rows_of(path: Path) -> list[dict[str, Any]]:
    reader = DeltaReader(JUDGED_TYPES)
    rows = [reader.row(record) for record in records(path)]
    return [row for row in rows if row is not None]


def packed(rows: list[dict[str, Any]]) -> list[bytes]:
    writer = DeltaWriter(list(rows[0]), Catalogue(JUDGED_TYPES), key_every=50)
    given = []
    for row in rows:
        writer.put(0, list(row.values()))
        given.append(writer.record())
    return given


def test_there_is_a_flight_of_every_scene_and_they_are_small() -> None:
    assert {path.stem for path in FLIGHTS} == CAUSES.keys()
    assert sum(path.stat().st_size for path in FLIGHTS) < 750_000


@pytest.mark.parametrize("path", FLIGHTS, ids=lambda path: path.stem)
def test_a_recorded_flight_is_judged_to_the_same_verdicts(path: Path) -> None:
    judgement = judge_again(records(path))
    assert judgement.difference is None
    assert judgement.unread == 0
    assert judgement.ticks > 200
    causes = {row["verdict"].cause.value for row in rows_of(path)}
    assert CAUSES[path.stem] in causes


def test_a_limit_one_bit_off_is_told_with_tick_and_field(monkeypatch: pytest.MonkeyPatch) -> None:
    rows = rows_of(DRIVING)
    stopped = next(row for row in rows if row["verdict"].cause.value == "estop")
    stopped["verdict"] = replace(stopped["verdict"], age_s=-0.0)
    difference = judge_again(packed(rows)).difference
    assert difference is not None
    assert difference.tick == stopped["tick"]
    assert (difference.field, difference.recorded) == ("Verdict.age_s", "-0.0")
    assert difference.judged == "0.0"


def test_a_state_that_does_not_follow_from_the_tick_before_is_told() -> None:
    rows = rows_of(DRIVING)
    at = next(i for i, row in enumerate(rows) if row["state"].estop_latched)
    rows[at] = {**rows[at], "state": replace(rows[at]["state"], latched=())}
    difference = judge_again(packed(rows)).difference
    assert difference is not None
    assert difference.tick == rows[at]["tick"]


def test_ticks_before_the_first_complete_one_are_counted() -> None:
    given = packed(rows_of(DRIVING))
    judgement = judge_again(given[1:])
    assert judgement.unread == 49
    assert judgement.ticks == len(given) - 50


def test_inputs_that_do_not_fit_this_version_are_refused_by_name() -> None:
    rows = rows_of(DRIVING)
    with pytest.raises(FlightForeign, match="smell"):
        judge_again(packed([{**row, "inputs.smell": 1.0} for row in rows]))
    for row in rows:
        del row["inputs.budget_stop"]
    with pytest.raises(FlightForeign, match=r"recorded by other rules.*budget_stop.*anew"):
        judge_again(packed(rows))


def test_spoiled_records_are_refused() -> None:
    with pytest.raises(FlightForeign, match="record of 3 bytes"):
        judge_again([b"abc"])


def test_the_command_judges_flights_and_its_exit_code_tells(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    path = str(DRIVING)
    assert main(["flight", "judge", path, "--json"]) == 0
    (told,) = json.loads(capsys.readouterr().out)
    assert told["difference"] is None
    original = judge.evaluate

    def laxer(state: Any, inputs: Any, limits: Any) -> Any:
        return original(state, replace(inputs, estop_source=None), limits)

    monkeypatch.setattr(judge, "evaluate", laxer)
    assert main(["flight", "judge", path]) == 1
    out = capsys.readouterr().out
    assert "differs: Verdict.reaction: recorded <Reaction.GROUP_STOP" in out
    monkeypatch.setattr("vla_deploy.cli.recording.flight.rules_digest", lambda: "of tomorrow")
    assert main(["flight", "judge", path]) == 1
    assert "recorded by other rules than these" in capsys.readouterr().out


def test_the_commands_list_and_show_flights(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["flight", "show", str(DRIVING)]) == 0
    assert "GROUP_STOP for estop" in capsys.readouterr().out
    assert main(["flight", "list", "--folder", str(DRIVING.parent)]) == 0
    assert "no flights in" in capsys.readouterr().out  # the examples have no numbers


def test_a_flight_that_was_cut_off_hides_no_other_one(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    whole = DRIVING.read_bytes()
    (tmp_path / "000001-stop.mcap").write_bytes(whole[: len(whole) // 2])
    (tmp_path / "000002-stop.mcap").write_bytes(whole)

    assert main(["flight", "list", "--folder", str(tmp_path)]) == 0
    cut, good = capsys.readouterr().out.splitlines()
    assert main(["flight", "list", "--folder", str(tmp_path), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)

    assert cut.startswith("000001-stop.mcap  unreadable: ")
    assert good.startswith("000002-stop.mcap  ")
    assert ["unreadable" in one for one in told] == [True, False]


def test_a_missing_flight_is_a_user_error(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    assert main(["flight", "show", "latest", "--folder", str(tmp_path)]) == 2
    assert "none yet" in capsys.readouterr().err
