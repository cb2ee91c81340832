import pytest

from vla_deploy.telemetry.triggers import Debounce, FlightTrigger, TriggerDetector, TriggerKind

S = 1_000_000_000


def status(state, cause=""):
    return {"state": state, "cause": cause, "detail": ""}


def table(**rows):
    return {
        "processes": [
            {
                "name": name,
                "state": state,
                "restarts": restarts,
                "exit_code": -9,
                "reason": "killed",
            }
            for name, (state, restarts) in rows.items()
        ]
    }


def stop(at_s, what="estop"):
    return FlightTrigger(kind=TriggerKind.STOP, what=what, at_ns=round(at_s * S))


@pytest.mark.parametrize(
    ("statuses", "causes"),
    [
        pytest.param(
            [
                status("armed"),
                status("stopping", "estop"),
                status("stopped", "estop"),
                status("disarmed"),
                status("armed"),
                status("stopping", "estop"),
            ],
            [[], ["estop"], [], [], [], ["estop"]],
            id="a stop triggers once, when it begins",
        ),
        pytest.param(
            [status("armed"), status("stopped", "following_error"), status("stopped", "estop")],
            [[], ["following_error"], ["estop"]],
            id="another cause during a stop triggers again",
        ),
        pytest.param(
            [status("disarmed"), status("fault", "can_bus_lost")],
            [[], ["can_bus_lost"]],
            id="a fault that forbids arming triggers",
        ),
        pytest.param(
            [status("armed"), status("stopping"), status("armed", "stale_command")],
            [[], [], []],
            id="an orderly disarm and a restricted base do not trigger",
        ),
    ],
)
def test_statuses_of_control_trigger(
    statuses: list[dict[str, str]], causes: list[list[str]]
) -> None:
    detector = TriggerDetector()
    assert [[one.what for one in detector.status(document, 0)] for document in statuses] == causes


def test_what_was_so_before_the_recorder_came_calls_nobody():
    detector = TriggerDetector()
    assert detector.status(status("stopped", "estop"), 0) == []
    assert detector.table(table(control=("back-off", 3)), 0) == []


def test_a_recorder_that_comes_after_one_that_crashed_calls():
    detector = TriggerDetector()
    (trigger,) = detector.table(table(control=("ready", 3), recorder=("starting", 1)), 5)
    assert (trigger.kind, trigger.what, trigger.detail) == (TriggerKind.CRASH, "recorder", "killed")
    assert detector.table(table(control=("ready", 3), recorder=("ready", 1)), 6) == []
    assert TriggerDetector().table(table(recorder=("starting", 0)), 5) == []


def test_each_crash_of_a_process_calls_once():
    detector = TriggerDetector()
    rows = (
        ("ready", 0),
        ("back-off", 0),
        ("starting", 1),
        ("ready", 1),
        ("ready", 2),  # the back-off in between was too short to be seen
        ("given up", 2),
    )
    told = [[t.what for t in detector.table(table(control=row), 0)] for row in rows]
    assert told == [[], ["control"], [], [], ["control"], ["control"]]


def test_an_orderly_stop_of_a_process_is_no_crash():
    detector = TriggerDetector()
    detector.table(table(planner=("ready", 0)), 0)
    assert detector.table(table(planner=("stopping", 0)), 0) == []
    assert detector.table(table(planner=("stopped", 0)), 0) == []


def test_a_flight_goes_on_for_three_seconds_after_its_cause():
    debounce = Debounce()
    debounce.add(stop(10))
    assert debounce.take(13 * S - 1) == []
    assert debounce.take(13 * S) == [stop(10)]
    assert debounce.take(99 * S) == []


def test_what_comes_meanwhile_joins_and_prolongs_up_to_ten_seconds():
    debounce = Debounce()
    for at_s in (10, 12, 14, 16, 18, 19.9):
        debounce.add(stop(at_s))
    assert debounce.take(20 * S - 1) == []
    assert len(debounce.take(20 * S)) == 6


def test_a_storm_of_stops_gives_a_few_flights():
    debounce, flights = Debounce(), 0
    for step in range(600):
        debounce.add(stop(step / 10))
        flights += bool(debounce.take(step * S // 10))
    assert 2 <= flights <= 4


def test_a_request_waits_for_nothing():
    debounce = Debounce()
    debounce.add(stop(10))
    assert debounce.take(13 * S)
    debounce.add(FlightTrigger(kind=TriggerKind.REQUEST, what="request", at_ns=14 * S))
    assert debounce.take(14 * S)


def test_the_end_of_the_run_takes_whatever_waits():
    debounce = Debounce()
    debounce.add(stop(10))
    assert debounce.take(float("inf")) == [stop(10)]
