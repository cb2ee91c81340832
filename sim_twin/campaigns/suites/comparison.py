"""Compare a suite's report with an earlier one, over the cases that both have played."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Final

from sim_twin.campaigns.selection import OptionRefused
from sim_twin.campaigns.suites.metrics import METRICS, SCORE, SCORE_SPREAD, measured_by_suite

_SPREADS: Final = {one.name: one.spread for one in METRICS} | {SCORE: SCORE_SPREAD}
_LESS_IS_BETTER: Final = frozenset(one.name for one in METRICS if one.less_is_better)
_ROUNDING: Final = 1e-9

ScoredCases = Mapping[str, Mapping[str, float]]
"""The metrics of each case by its name, which begins with its suite."""


class EarlierReportUnusable(OptionRefused):
    """Say why an earlier report cannot be compared with."""


@dataclass(frozen=True, slots=True, kw_only=True)
class MetricChange:
    """Hold one metric of one suite in both reports."""

    suite: str
    metric: str
    earlier: float
    now: float

    @property
    def difference(self) -> float:
        """Return by how much it has risen."""
        return self.now - self.earlier

    @property
    def is_regression(self) -> bool:
        """Return whether it is worse by more than its spread."""
        sign = 1.0 if self.metric in _LESS_IS_BETTER else -1.0
        return sign * self.difference > _SPREADS[self.metric] + _ROUNDING


@dataclass(frozen=True, slots=True, kw_only=True)
class ReportComparison:
    """Hold the changes over the common cases, and which cases only one report has."""

    earlier: str
    changes: tuple[MetricChange, ...]
    only_earlier: tuple[str, ...]
    only_now: tuple[str, ...]

    @property
    def regressions(self) -> tuple[MetricChange, ...]:
        """Return what has become worse."""
        return tuple(change for change in self.changes if change.is_regression)

    def document(self) -> dict[str, Any]:
        """Return it as JSON."""
        return {
            "earlier": self.earlier,
            "changes": [
                asdict(one)
                | {"difference": round(one.difference, 4), "regression": one.is_regression}
                for one in self.changes
            ],
            "only_earlier": list(self.only_earlier),
            "only_now": list(self.only_now),
        }


def read_scored_cases(path: Path, names: Sequence[str]) -> dict[str, dict[str, float]]:
    """Return the cases of a report that `--json` has printed; `names` are of those to come.

    Raises:
        EarlierReportUnusable: there is no such file, it is no report of a suite, or it has none
            of these cases.
    """
    try:
        document = json.loads(path.read_text(encoding="utf-8"))
        found = {
            one["name"]: {name: float(value) for name, value in one["metrics"].items()}
            for one in document["results"]
            if not one["skipped"]
        }
    except OSError as error:
        raise EarlierReportUnusable(f"--compare {path}: {error.strerror}") from error
    except (ValueError, TypeError, KeyError, AttributeError) as error:
        raise EarlierReportUnusable(
            f"--compare {path}: expected what `vla-deploy validate suite --json` prints, "
            f"got something else ({error!r})"
        ) from error
    if found.keys().isdisjoint(names):
        raise EarlierReportUnusable(
            f"--compare {path}: none of the {len(names)} cases is among its {len(found)}; "
            "play the same suite with the same --seed and --count"
        )
    return found


def compare(earlier: ScoredCases, now: ScoredCases, told_earlier: str) -> ReportComparison:
    """Return what has changed over the cases that both have."""
    common = [name for name in now if name in earlier]
    before, after = (_by_suite(common, cases) for cases in (earlier, now))
    return ReportComparison(
        earlier=told_earlier,
        changes=tuple(
            MetricChange(suite=suite, metric=metric, earlier=before[suite][metric], now=value)
            for suite, metrics in after.items()
            for metric, value in metrics.items()
            if metric in before[suite]
        ),
        only_earlier=tuple(name for name in earlier if name not in now),
        only_now=tuple(name for name in now if name not in earlier),
    )


def _by_suite(names: Sequence[str], cases: ScoredCases) -> dict[str, dict[str, float]]:
    return measured_by_suite([(name.partition("/")[0], cases[name]) for name in names])
