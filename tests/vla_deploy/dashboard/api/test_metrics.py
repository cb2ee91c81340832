"""Metrics and their history are answered over HTTP, with reasons for what is missing."""

import asyncio
from typing import Any

import httpx
from prometheus_client.parser import text_string_to_metric_families

BOARD = {"readings": {"power_w": 9.5}, "missing": {"gpu_load_ratio": "missing, because no GPU"}}
MANY = 40


def test_a_scraper_gets_what_the_processes_tell(dashboard: Any) -> None:
    dashboard.robot.shows("board", **BOARD)
    answer = dashboard.client.get("/metrics")
    assert answer.headers["content-type"].startswith("text/plain; version=")
    families = {one.name: one for one in text_string_to_metric_families(answer.text)}
    assert families["vla_power_watts"].samples[0].value == 9.5
    assert "vla_gpu_load_ratio" not in families


def test_openmetrics_is_spoken_to_those_who_ask_for_it(dashboard: Any) -> None:
    accept = {"accept": "application/openmetrics-text; version=1.0.0"}
    answer = dashboard.client.get("/metrics", headers=accept)
    assert answer.headers["content-type"].startswith("application/openmetrics-text")
    assert answer.text.endswith("# EOF\n")


def test_whoever_comes_from_afar_without_a_token_gets_no_metrics(stranger: Any) -> None:
    for path in ("/metrics", "/api/v1/metrics", "/api/v1/history?series=vla_power_watts"):
        assert stranger.get(path).status_code == 401


def test_reasons_are_told_in_words(dashboard: Any) -> None:
    dashboard.robot.shows("board", **BOARD)
    missing = dashboard.get("metrics")["missing"]
    assert missing["vla_gpu_load_ratio"]["text"] == "missing, because no GPU"
    assert missing["vla_control_state"]["why"] == "silent"


def test_the_history_of_a_metric_has_all_its_series_with_labels(dashboard: Any) -> None:
    row = {"name": "control", "memory_mb": 50.0, "state": "ready", "restarts": 0, "alarms": []}
    head = {"robot": "butler", "profile": "desktop", "twin": True, "refusal": ""}
    dashboard.robot.shows("process_table", **head, processes=[row])
    dashboard.app.state.metering.step()
    told = dashboard.get("history", series="vla_process_memory_bytes", span_s=60)
    (series,) = told["series"]
    assert (series["labels"], series["unit"]) == ({"process": "control"}, "bytes")
    assert series["values"].count(50e6) == 1
    assert len(series["values"]) == len(told["times_s"]) == 60
    assert told["times_s"][-1] <= told["end_s"] + 1.0
    listed = dashboard.get("history/series")
    assert "vla_process_memory_bytes/control" in [one["series"] for one in listed["series"]]


def test_a_metric_without_history_yet_says_why_and_an_unknown_name_is_refused(
    dashboard: Any,
) -> None:
    dashboard.robot.shows("board", **BOARD)
    dashboard.app.state.metering.step()
    told = dashboard.get("history", series="vla_gpu_load_ratio", span_s=600)
    assert told["series"] == []
    assert told["missing"] == {"vla_gpu_load_ratio": "missing, because no GPU"}
    answer = dashboard.get("history", 404, series="vla_power_watts,nonsense")
    assert "nonsense" in answer["error"]["what"]
    assert dashboard.get("history", 422, series="vla_power_watts", span_s=1e9)


def test_diagnostics_are_told_for_who_bridges_to_ros(dashboard: Any) -> None:
    dashboard.robot.shows("board", **BOARD)
    array = dashboard.get("diagnostics")
    assert {status["level"] for status in array["status"]} <= {0, 1, 2, 3}


def test_without_a_place_for_it_the_reason_takes_the_history_s_place(dashboard: Any) -> None:
    part = dashboard.app.state.metering
    part.stop()
    part.why_not = "/var/log: no space left"
    part.step()
    answer = dashboard.get("history", 503, series="vla_power_watts")
    assert answer["error"]["what"] == "/var/log: no space left"
    assert dashboard.client.get("/metrics").status_code == 200


def test_a_long_history_lets_others_have_their_turns(dashboard: Any) -> None:
    rows = [
        {"name": f"p{n}", "memory_mb": 1.0, "state": "ready", "restarts": 0, "alarms": []}
        for n in range(MANY)
    ]
    head = {"robot": "butler", "profile": "desktop", "twin": True, "refusal": ""}
    dashboard.robot.shows("process_table", **head, processes=rows)
    dashboard.app.state.metering.step()
    told, turns = asyncio.run(asked_beside_others(dashboard.app, "vla_process_memory_bytes"))
    assert len(told["series"]) == MANY
    assert turns > MANY


async def asked_beside_others(app: Any, series: str) -> tuple[Any, int]:
    """Return a metric's history, and how often another task had its turn meanwhile."""
    transport = httpx.ASGITransport(app, client=("127.0.0.1", 50_000))
    async with httpx.AsyncClient(transport=transport, base_url="http://127.0.0.1:8088") as client:
        asking = asyncio.create_task(client.get("/api/v1/history", params={"series": series}))
        turns = 0
        while not asking.done():
            turns += 1
            await asyncio.sleep(0)
        return asking.result().json(), turns
