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


def causes(watcher, *documents):
    return [[t.what for t in watcher.status(document, 0)] for document in documents]


def test_a_stop_calls_once_when_it_begins():
    told = causes(
        TriggerDetector(),
        status("armed"),
        status("stopping", "estop"),
        status("stopped", "estop"),
        status("disarmed"),
        status("armed"),
        status("stopping", "estop"),
    )
    assert told == [[], ["estop"], [], [], [], ["estop"]]


def test_a_graver_cause_during_a_stop_calls_again():
    told = causes(
        TriggerDetector(),
        status("armed"),
        status("stopped", "following_error"),
        status("stopped", "estop"),
    )
    assert told == [[], ["following_error"], ["estop"]]


def test_a_fault_that_forbids_arming_calls():
    assert causes(TriggerDetector(), status("disarmed"), status("fault", "can_bus_lost")) == [
        [],
        ["can_bus_lost"],
    ]


def test_an_orderly_disarm_and_a_restricted_base_call_nobody():
    told = causes(
        TriggerDetector(), status("armed"), status("stopping"), status("armed", "stale_command")
    )
    assert told == [[], [], []]


def test_what_was_so_before_the_recorder_came_calls_nobody():
    watcher = TriggerDetector()
    assert watcher.status(status("stopped", "estop"), 0) == []
    assert watcher.table(table(control=("back-off", 3)), 0) == []


def test_a_recorder_that_comes_after_one_that_crashed_calls():
    watcher = TriggerDetector()
    (trigger,) = watcher.table(table(control=("ready", 3), recorder=("starting", 1)), 5)
    assert (trigger.kind, trigger.what, trigger.detail) == (TriggerKind.CRASH, "recorder", "killed")
    assert watcher.table(table(control=("ready", 3), recorder=("ready", 1)), 6) == []
    assert TriggerDetector().table(table(recorder=("starting", 0)), 5) == []


def test_each_crash_of_a_process_calls_once():
    watcher = TriggerDetector()
    rows = (
        ("ready", 0),
        ("back-off", 0),
        ("starting", 1),
        ("ready", 1),
        ("ready", 2),  # the back-off in between was too short to be seen
        ("given up", 2),
    )
    told = [[t.what for t in watcher.table(table(control=row), 0)] for row in rows]
    assert told == [[], ["control"], [], [], ["control"], ["control"]]


def test_an_orderly_stop_of_a_process_is_no_crash():
    watcher = TriggerDetector()
    watcher.table(table(planner=("ready", 0)), 0)
    assert watcher.table(table(planner=("stopping", 0)), 0) == []
    assert watcher.table(table(planner=("stopped", 0)), 0) == []


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
