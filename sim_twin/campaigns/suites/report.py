"""Report a suite: metrics by suite beside its cases, with what was seen of each."""

from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, field
from typing import Any, Final

from sim_twin.campaigns.evidence import SceneEvidence
from sim_twin.campaigns.report import CampaignCase, CampaignReport
from sim_twin.campaigns.suites.comparison import ReportComparison, ScoredCases
from sim_twin.campaigns.suites.metrics import METRIC_NAMES, measured_by_suite

_WIDTH: Final = 16
_SEEN: Final = "evidence"


@dataclass(frozen=True, slots=True, kw_only=True)
class ScoredCase(CampaignCase):
    """Hold a case with its share in the metrics, and what was seen of its robots."""

    metrics: Mapping[str, float] = field(default_factory=dict)
    evidence: tuple[SceneEvidence, ...] = ()

    @property
    def suite(self) -> str:
        """Return the suite that it belongs to."""
        return self.name.partition("/")[0]


@dataclass(frozen=True, slots=True, kw_only=True)
class SuiteReport(CampaignReport):
    """Hold what the suites found; a regression is not passed either."""

    cases: tuple[ScoredCase, ...]
    comparison: ReportComparison | None = None

    @property
    def passed(self) -> bool:
        """Return whether no case failed and nothing has become worse."""
        return not self.failed and not (self.comparison and self.comparison.regressions)

    @property
    def scored(self) -> ScoredCases:
        """Return the metrics of each case that was played."""
        return {case.name: case.metrics for case in self.cases if not case.skipped}

    @property
    def metrics(self) -> dict[str, dict[str, float]]:
        """Return the metrics of each suite, and overall."""
        played = [case for case in self.cases if not case.skipped]
        return measured_by_suite([(case.suite, case.metrics) for case in played])

    def document(self) -> dict[str, Any]:
        """Return the report as JSON, without what was seen."""
        told = CampaignReport.document(self)
        results = [
            {key: value for key, value in asdict(case).items() if key != _SEEN}
            for case in self.cases
        ]
        compared = {"comparison": self.comparison.document()} if self.comparison else {}
        return told | {"metrics": self.metrics, **compared, "results": results}

    def text(self) -> str:
        """Return the metrics as a table, what has changed, and what failed."""
        lines = [*self._table(), *self._changes()]
        return "\n".join([*lines, CampaignReport.text(self)])

    def _table(self) -> Iterator[str]:
        told = self.metrics
        yield " " * _WIDTH + "".join(f"{name:>{_WIDTH}}" for name in told)
        for metric in METRIC_NAMES:
            values = [figures.get(metric) for figures in told.values()]
            if any(value is not None for value in values):
                row = ("-" if value is None else f"{value:.4g}" for value in values)
                yield f"{metric:{_WIDTH}}" + "".join(f"{one:>{_WIDTH}}" for one in row)

    def _changes(self) -> Iterator[str]:
        if self.comparison is None:
            return
        yield f"compared with {self.comparison.earlier}:"
        for one in self.comparison.changes:
            if one.difference:
                mark = "  REGRESSION" if one.is_regression else ""
                change = f"{one.earlier:.4g} -> {one.now:.4g} ({one.difference:+.4g})"
                yield f"{one.suite + ' ' + one.metric:{2 * _WIDTH}} {change}{mark}"
        counts = len(self.comparison.only_earlier), len(self.comparison.only_now)
        yield f"{len(self.comparison.regressions)} regressions; cases only then, only now: {counts}"
