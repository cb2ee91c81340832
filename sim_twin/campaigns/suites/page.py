"""Write a suite's report as one page for a browser, with all that it shows inside."""

from base64 import b64encode
from pathlib import Path
from typing import Final

from jinja2 import Environment, StrictUndefined
from markupsafe import Markup

from sim_twin.campaigns.suites import plots
from sim_twin.campaigns.suites.metrics import METRICS, SCORE, SCORE_SPREAD
from sim_twin.campaigns.suites.report import SuiteReport

_TEMPLATE: Final = Path(__file__).with_name("page.html")
_LEAST_POINTS: Final = 20
"""Of a way that is worth a plot: they are 0.03 m and more apart."""


def write_page(report: SuiteReport, path: Path) -> None:
    """Write the page."""
    path.write_text(page(report), encoding="utf-8")


def page(report: SuiteReport) -> str:
    """Return the page: it is XHTML, too, and asks no server for anything."""
    environment = Environment(
        autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    environment.filters |= {"figure": _figure, "picture": _picture}
    measured = report.metrics
    scores = {suite: figures[SCORE] for suite, figures in measured.items()}
    return environment.from_string(_TEMPLATE.read_text(encoding="utf-8")).render(
        report=report,
        measured=measured,
        metrics=METRICS,
        score_spread=SCORE_SPREAD,
        scores=Markup(plots.bars(scores, "scores by suite")),
        rates={
            suite: Markup(plots.bars(rates, f"shares of {suite}"))
            for suite, figures in measured.items()
            if (rates := _shares(figures))
        },
        plans={
            case.name: [
                Markup(plots.floor_plan(seen, f"way of {case.name}"))
                for seen in case.evidence
                if len(seen.path_m) >= _LEAST_POINTS
            ]
            for case in report.cases
        },
    )


def _shares(figures: dict[str, float]) -> dict[str, float]:
    """Return the metrics that lie between 0 and 1."""
    units = {one.name: one.unit or ("count" if one.less_is_better else "") for one in METRICS}
    return {name: value for name, value in figures.items() if not units.get(name, "")}


def _figure(value: object) -> str:
    if value is None:
        return "-"
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def _picture(jpeg: bytes) -> str:
    return f"data:image/jpeg;base64,{b64encode(jpeg).decode()}"
