"""Suites score what was played, compare it with earlier reports, and show it on one page."""

import argparse
import json
import sys
from collections.abc import Callable
from html.parser import HTMLParser
from pathlib import Path
from xml.etree import ElementTree

import pytest

from sim_twin.campaigns import __main__ as campaigns
from sim_twin.campaigns.evidence import SceneEvidence
from sim_twin.campaigns.report import CampaignCase
from sim_twin.campaigns.suites import suite
from sim_twin.campaigns.suites.comparison import compare
from sim_twin.campaigns.suites.metrics import METRICS, SuiteMetric, measured, measured_by_suite
from sim_twin.campaigns.suites.page import page
from sim_twin.campaigns.suites.ray_tasks import LOCAL, RayUnusable, played_by_ray
from sim_twin.campaigns.suites.report import ScoredCase, SuiteReport
from sim_twin.campaigns.suites.scenes import SUITES, SuiteScene, play, scenes_of, scored
from vla_deploy.cli.maintenance import measure

STOP = SuiteScene(suite="safety", scene="emergency_stop/reaching", seed=0)
SEEN = SceneEvidence(
    path_m=tuple((0.1 * step, 0.0) for step in range(30)),
    outlines_m=(((1.0, 1.0), (2.0, 1.0), (2.0, 2.0)),),
    log=("1.0 s  control: armed <now>",),
    pictures_jpeg=b"a picture",
)
GOOD = ScoredCase(
    name="navigation/drives/0",
    metrics={"success_rate": 1.0, "path_efficiency": 0.9, "collisions": 0.0},
    evidence=(SEEN,),
)
BAD = ScoredCase(
    name="integration/documents/0",
    failures=("touched <something> & fell",),
    metrics=dict.fromkeys((one.name for one in METRICS), 0.5),
    evidence=(SEEN,),
)
SKIPPED = ScoredCase(name="voice/turn/0", skipped="no voice is installed")


def report_of(*cases: ScoredCase) -> SuiteReport:
    return SuiteReport(campaign="suite", cases=cases)


@pytest.mark.parametrize(
    ("cases", "expected"),
    [
        ([], {}),
        ([{"success_rate": 1.0}], {"success_rate": 1.0, "score": 1.0}),
        ([{"success_rate": 1.0}, {"success_rate": 0.0}], {"success_rate": 0.5, "score": 0.5}),
        # What one case alone gives counts for all; collisions are summed, the free cases score.
        (
            [{"success_rate": 1.0, "collisions": 2.0}, {"success_rate": 1.0, "collisions": 0.0}],
            {"success_rate": 1.0, "collisions": 2.0, "score": (4.0 + 2.0 * 0.5) / 6.0},
        ),
        ([{"placement_mm": 20.0}], {"placement_mm": 20.0, "score": 0.8}),
        ([{"placement_mm": 300.0}], {"placement_mm": 300.0, "score": 0.0}),
        ([{"response_s": 0.3}, {"response_s": 9.0}, {"response_s": 0.6}], {"score": 0.8}),
    ],
)
def test_cases_are_measured_by_the_one_table(
    cases: list[dict[str, float]], expected: dict[str, float]
) -> None:
    found = measured(cases)
    assert {name: found[name] for name in expected} == pytest.approx(expected, abs=1e-4)
    assert found.keys() - {"score"} == {name for case in cases for name in case}


@pytest.mark.parametrize("metric", METRICS, ids=lambda one: one.name)
def test_the_documentation_has_each_weight_and_spread(metric: SuiteMetric) -> None:
    docs = Path(__file__).parents[3] / "docs" / "validation.md"
    row = f"| `{metric.name}` | {metric.weight:g} | {metric.spread:g} | {metric.meaning} |"
    assert row in docs.read_text(encoding="utf-8")


def test_every_suite_weighs_the_same_in_the_overall_score() -> None:
    good, bad = {"success_rate": 1.0}, {"success_rate": 0.0}
    told = measured_by_suite([("a", good), ("a", good), ("a", good), ("b", bad)])
    assert (told["overall"]["score"], told["overall"]["success_rate"]) == (0.5, 0.75)
    assert "overall" not in measured_by_suite([("a", good)])


@pytest.mark.parametrize(
    ("metric", "earlier", "now", "is_regression"),
    [
        ("success_rate", 1.0, 0.9, True),
        ("success_rate", 0.9, 1.0, False),
        ("placement_mm", 10.0, 10.9, False),
        ("placement_mm", 10.0, 11.5, True),
        ("placement_mm", 11.5, 10.0, False),
        ("response_s", 0.30, 0.32, False),
        ("response_s", 0.30, 0.33, True),
        ("collisions", 0.0, 1.0, True),
    ],
)
def test_what_is_worse_by_more_than_the_spread_is_a_regression(
    metric: str, earlier: float, now: float, is_regression: bool
) -> None:
    case = "safety/stop/0"
    compared = compare({case: {metric: earlier}}, {case: {metric: now}}, "then.json")
    told = {one.metric: one.is_regression for one in compared.changes}
    assert told[metric] is is_regression
    assert bool(compared.regressions) is is_regression
    assert compared.document()["changes"][0]["earlier"] == earlier


def test_only_cases_of_both_reports_are_compared() -> None:
    failed = {"success_rate": 0.0}
    compared = compare(
        {"safety/a/0": failed, "safety/b/0": failed}, {"safety/b/0": failed, "voice/c/0": {}}, "x"
    )
    assert [(one.suite, one.earlier) for one in compared.changes if one.metric == "score"] == [
        ("safety", 0.0)
    ]
    assert (compared.only_earlier, compared.only_now) == (("safety/a/0",), ("voice/c/0",))


class _Links(HTMLParser):
    def __init__(self) -> None:
        super().__init__()
        self.links: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.links += [str(value) for name, value in attrs if name in ("src", "href")]


def test_the_page_holds_each_metric_and_what_was_seen_of_failures_and_asks_no_server() -> None:
    compared = compare({BAD.name: {"success_rate": 1.0}}, {BAD.name: BAD.metrics}, "then.json")
    report = SuiteReport(campaign="suite", cases=(GOOD, BAD, SKIPPED), comparison=compared)
    text = page(report)
    root = ElementTree.fromstring(text.partition("\n")[2])
    space = "{http://www.w3.org/1999/xhtml}"
    tables = {one.get("id"): "".join(one.itertext()) for one in root.iter(f"{space}table")}
    assert all(one.name in str(tables["metrics"]) for one in METRICS)
    assert "regression" in str(tables["comparison"])
    assert "skipped: no voice is installed" in str(tables["cases"])
    (failure,) = root.iter(f"{space}section")
    assert "touched <something> & fell" in "".join(failure.itertext())
    assert "armed <now>" in "".join(failure.itertext())
    assert len(list(root.iter(f"{space}polyline"))) == 2
    links = _Links()
    links.feed(text)
    assert links.links == ["data:image/jpeg;base64,YSBwaWN0dXJl"]
    assert "http" not in text.replace("http://www.w3.org/1999/xhtml", "")


def test_the_document_has_no_pictures_and_a_metric_without_data_is_absent() -> None:
    document = json.loads(json.dumps(report_of(GOOD, SKIPPED).document()))
    assert document["metrics"] == {
        "navigation": {
            "success_rate": 1.0,
            "path_efficiency": 0.9,
            "collisions": 0.0,
            "score": 0.9857,
        }
    }
    assert all("evidence" not in one for one in document["results"])
    assert "coordination" not in report_of(GOOD).text()


def test_figures_of_the_campaigns_become_metrics() -> None:
    mission = SuiteScene(suite="integration", scene="side_by_side", seed=3)
    figures = {"share": 0.3, "placement_error_m": 0.012}
    found = scored(mission, CampaignCase(name="", figures=figures), (SEEN,), 1.0)
    assert found.name == "integration/side_by_side/3"
    assert found.metrics == pytest.approx(
        {"success_rate": 1.0, "coordination": 0.7, "placement_mm": 12.0}
    )
    assert found.evidence[0].pictures_jpeg == b""


def test_the_command_offers_the_suites_that_there_are() -> None:
    assert tuple(measure.SUITES) == (*SUITES, "all")
    names = [case.name for case in scenes_of("all", range(4, 6))]
    assert len(names) == len(set(names)) == 2 * sum(len(one.scenes) for one in SUITES.values())


@pytest.mark.parametrize(
    ("earlier", "now", "code"), [(None, GOOD, 0), (None, BAD, 1), (GOOD, GOOD, 0), (BAD, GOOD, 2)]
)
def test_failures_and_regressions_end_with_1_and_unusable_reports_with_2(
    earlier: ScoredCase | None,
    now: ScoredCase,
    code: int,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def instead(
        _cases: list[SuiteScene], _options: argparse.Namespace, _tell: Callable[[str], None]
    ) -> tuple[ScoredCase, ...]:
        return (now,)

    monkeypatch.setattr(suite, "_played", instead)
    words = ["suite", "navigation", "--count", "1", "--html", str(tmp_path / "new" / "x.html")]
    if earlier is not None:
        path = tmp_path / "then.json"
        path.write_text(json.dumps(report_of(earlier).document()), encoding="utf-8")
        words += ["--compare", str(path)]
    assert campaigns.main(words) == code
    assert (tmp_path / "new" / "x.html").exists() is (code < 2)


def test_a_regression_alone_ends_with_1() -> None:
    worse = {**GOOD.metrics, "path_efficiency": 0.8}
    compared = compare({GOOD.name: GOOD.metrics}, {GOOD.name: worse}, "then.json")
    assert report_of(GOOD).passed
    assert not SuiteReport(campaign="suite", cases=(GOOD,), comparison=compared).passed


@pytest.mark.parametrize("text", ["no json", "[]", '{"results": [{"name": "x"}]}'])
def test_what_is_no_earlier_report_is_refused_before_anything_is_played(
    text: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "then.json"
    path.write_text(text, encoding="utf-8")
    assert campaigns.main(["suite", "safety", "--compare", str(path)]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith(f"validate suite: --compare {path}: expected what")


@pytest.mark.parametrize("words", [["safety"], ["--html", "x.html"], ["--ray"]])
def test_options_of_suites_are_no_options_of_campaigns(
    words: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as ended:
        campaigns.main(["faults", *words])
    assert ended.value.code == 2
    assert "is of `validate suite`, not of `validate faults`" in capsys.readouterr().err


@pytest.mark.gl
def test_a_stop_is_played_judged_and_recorded_twice_the_same() -> None:
    first, second = play(STOP), play(STOP)
    assert first.failures == ()
    assert first.metrics == second.metrics
    assert first.metrics["accuracy"] == 1.0
    assert 0.0 < first.metrics["response_s"] < 1.0
    assert any("stopping estop" in line for line in first.evidence[0].log)


def test_without_ray_the_option_says_how_to_install_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "ray", None)
    with pytest.raises(RayUnusable, match=r"pip install 'vla-deploy\[ray\]'"):
        played_by_ray(play, [STOP], LOCAL, 1, print)


@pytest.mark.filterwarnings("ignore")  # Ray's own
def test_cases_are_tasks_of_ray_and_come_back_in_order() -> None:
    pytest.importorskip("ray", reason="Ray is not installed: pip install 'vla-deploy[ray]'")

    def instead(number: int) -> CampaignCase:
        return CampaignCase(name=str(number), figures={"square": number**2})

    rows: list[str] = []
    cases = played_by_ray(instead, range(3), LOCAL, 2, rows.append)
    assert [case.figures["square"] for case in cases] == [0, 1, 4]
    assert [row.split()[0] for row in rows] == ["0", "1", "2"]
