"""Measure cases that were played: one table says what counts, how much, and how exact it is."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from statistics import mean, median
from typing import Final

Values = Sequence[float]
SCORE: Final = "score"
_WORST_PLACEMENT_MM: Final = 100.0
"""So far from its middle a thing leans on the wall of the box, which is 0.22 m wide inside."""
_WORST_RESPONSE_S: Final = 3.0


@dataclass(frozen=True, slots=True, kw_only=True)
class SuiteMetric:
    """Describe one figure; `worth` turns its cases' values into 0 (bad) to 1 (as good as can be).

    Two runs of the same seeds may differ by `spread`; more to the worse is a regression.
    """

    name: str
    unit: str
    weight: float
    summed: Callable[[Values], float]
    worth: Callable[[Values], float]
    spread: float
    less_is_better: bool = False
    meaning: str


def _down_to_zero(worst: float) -> Callable[[Values], float]:
    return lambda values: max(0.0, 1.0 - median(values) / worst)


def _share_of_zeros(values: Values) -> float:
    return mean(value == 0.0 for value in values)


METRICS: Final = (
    SuiteMetric(
        name="success_rate",
        unit="",
        weight=4.0,
        summed=mean,
        worth=mean,
        spread=0.0,
        meaning="share of the cases in which nothing was wrong",
    ),
    SuiteMetric(
        name="accuracy",
        unit="",
        weight=2.0,
        summed=mean,
        worth=mean,
        spread=0.001,
        meaning="commands understood, time beside who is followed, actions that succeeded, "
        "causes named right",
    ),
    SuiteMetric(
        name="path_efficiency",
        unit="",
        weight=1.0,
        summed=mean,
        worth=mean,
        spread=0.001,
        meaning="length of the map's shortest way over the way driven",
    ),
    SuiteMetric(
        name="collisions",
        unit="",
        weight=2.0,
        summed=sum,
        worth=_share_of_zeros,
        spread=0.0,
        less_is_better=True,
        meaning="contacts by MuJoCo: the robot pushed what stands fast or itself with more than "
        "60 N, or touched something on a drive",
    ),
    SuiteMetric(
        name="placement_mm",
        unit="mm",
        weight=1.0,
        summed=median,
        worth=_down_to_zero(_WORST_PLACEMENT_MM),
        spread=1.0,
        less_is_better=True,
        meaning="median distance of a thing from the middle of what it was put into",
    ),
    SuiteMetric(
        name="response_s",
        unit="s",
        weight=1.0,
        summed=median,
        worth=_down_to_zero(_WORST_RESPONSE_S),
        spread=0.02,
        less_is_better=True,
        meaning="median of the twin's time from the last word to the first action, from a fault "
        "or stop to rest, or to the reaction where the robot may move on",
    ),
    SuiteMetric(
        name="coordination",
        unit="",
        weight=1.0,
        summed=mean,
        worth=mean,
        spread=0.001,
        meaning="share of the time that two arms, base, head and voice save by working side by "
        "side instead of one after the other",
    ),
)
"""Weights are those of the score, which is the weighted mean of what there is."""
SCORE_SPREAD: Final = 0.01
METRIC_NAMES: Final = (*(one.name for one in METRICS), SCORE)


def measured(cases: Sequence[Mapping[str, float]]) -> dict[str, float]:
    """Return the metrics of cases by what each gave; what no case gave is absent."""
    figures, worths, weights = {}, [], []
    for metric in METRICS:
        values = [case[metric.name] for case in cases if metric.name in case]
        if values:
            figures[metric.name] = round(float(metric.summed(values)), 4)
            worths.append(metric.weight * metric.worth(values))
            weights.append(metric.weight)
    return figures | ({SCORE: round(sum(worths) / sum(weights), 4)} if weights else {})


def measured_by_suite(
    cases: Sequence[tuple[str, Mapping[str, float]]],
) -> dict[str, dict[str, float]]:
    """Return the metrics of each suite, then of all cases: its score is the mean of the suites'."""
    suites = list(dict.fromkeys(suite for suite, _ in cases))
    told = {
        suite: measured([figures for name, figures in cases if name == suite]) for suite in suites
    }
    scores = [figures[SCORE] for figures in told.values() if SCORE in figures]
    if len(suites) > 1 and scores:
        overall = measured([figures for _, figures in cases])
        told["overall"] = overall | {SCORE: round(mean(scores), 4)}
    return told
