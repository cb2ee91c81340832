"""Draw a report's plots as SVG that stands in a page: no script, nothing from elsewhere."""

from collections.abc import Mapping, Sequence
from html import escape
from typing import Final

from sim_twin.campaigns.evidence import Point, SceneEvidence

_BAR_HEIGHT: Final = 18
_BAR_GAP: Final = 6
_LABEL_WIDTH: Final = 150
_BAR_WIDTH: Final = 320
_PIXELS_PER_M: Final = 28.0
_MARGIN_M: Final = 0.3
_DOT_M: Final = 0.12


def bars(values: Mapping[str, float], title: str) -> str:
    """Return one bar for each value of 0 to 1, with its name."""
    height = len(values) * (_BAR_HEIGHT + _BAR_GAP)
    rows = []
    for row, (name, value) in enumerate(values.items()):
        top = row * (_BAR_HEIGHT + _BAR_GAP)
        width = _BAR_WIDTH * min(max(value, 0.0), 1.0)
        base = top + _BAR_HEIGHT - 4
        rows.append(
            f'<text x="{_LABEL_WIDTH - 8}" y="{base}" text-anchor="end">{escape(name)}</text>'
            f'<rect class="full" x="{_LABEL_WIDTH}" y="{top}" width="{_BAR_WIDTH}" '
            f'height="{_BAR_HEIGHT}"/>'
            f'<rect class="bar" x="{_LABEL_WIDTH}" y="{top}" width="{width:.1f}" '
            f'height="{_BAR_HEIGHT}"/>'
            f'<text x="{_LABEL_WIDTH + _BAR_WIDTH + 8}" y="{base}">{value:.3g}</text>'
        )
    return _svg(_LABEL_WIDTH + _BAR_WIDTH + 60, height, title, rows)


def floor_plan(seen: SceneEvidence, title: str) -> str:
    """Return the robot's way among what stands there; a ring where it began, a dot at the end."""
    points = [*(point for outline in seen.outlines_m for point in outline), *seen.path_m]
    low_x, high_x = _extent([x_m for x_m, _ in points])
    low_y, high_y = _extent([y_m for _, y_m in points])

    def at(point: Point) -> str:
        x, y = (point[0] - low_x) * _PIXELS_PER_M, (high_y - point[1]) * _PIXELS_PER_M
        return f"{x:.1f},{y:.1f}"

    def dot(point: Point, kind: str) -> str:
        x, y = at(point).split(",")
        return f'<circle class="{kind}" cx="{x}" cy="{y}" r="{_DOT_M * _PIXELS_PER_M:.1f}"/>'

    parts = [f'<polygon points="{" ".join(map(at, one))}"/>' for one in seen.outlines_m]
    parts += [dot(point, "other") for point in seen.others_m]
    parts += [f'<polyline points="{" ".join(map(at, seen.path_m))}"/>']
    parts += [dot(seen.path_m[0], "begin"), dot(seen.path_m[-1], "end")]
    width, height = (high_x - low_x) * _PIXELS_PER_M, (high_y - low_y) * _PIXELS_PER_M
    return _svg(round(width), round(height), title, parts)


def _extent(values: Sequence[float]) -> tuple[float, float]:
    return min(values) - _MARGIN_M, max(values) + _MARGIN_M


def _svg(width: int, height: int, title: str, parts: Sequence[str]) -> str:
    return (
        f'<svg role="img" width="{width}" height="{height}" viewBox="0 0 {width} {height}">'
        f"<title>{escape(title)}</title>{''.join(parts)}</svg>"
    )
