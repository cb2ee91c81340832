/**
 * Draw curves over time by uPlot: gaps stay gaps, budget lines are dashed, colours follow the theme.
 *
 * A chart is {unit, digits, curves: [{name, colour, values, limit?}]}; times are seconds of the
 * wall clock, values are null where nothing could be read.
 */

import uPlot from "../vendor/uplot.js";

const HEIGHT_PX = 168;
const PAD_RATIO = 0.08;
const FONT = "11px system-ui, sans-serif";

/** Make a chart in `place`; the returned object takes new data and must be destroyed at last. */
export function makeChart(place, { unit, digits, curves, colours, describe }) {
  const plot = new uPlot(
    {
      width: Math.max(place.clientWidth, 120),
      height: HEIGHT_PX,
      cursor: { y: false, drag: { x: false, y: false }, sync: { key: "budgets" } },
      legend: { show: false },
      padding: [8, 8, 0, 0],
      scales: { x: { time: true }, y: { range: (_, low, high) => range(low, high, curves) } },
      axes: [{ ...axis(colours, 28), space: 64, values: (_, ticks) => ticks.map(clockWords) }, { ...axis(colours, 52), values: (_, ticks) => ticks.map((one) => short(one, unit)) }],
      series: [{}, ...curves.map((curve) => series(curve))],
      hooks: { draw: [(drawn) => drawLimits(drawn, curves, colours)], setCursor: [(at) => describe(told(at, curves, unit, digits))] },
    },
    [[], ...curves.map(() => [])],
    place,
  );
  return {
    show: (times_s, values, span) => {
      plot.batch(() => {
        plot.setData([times_s, ...values], false);
        plot.setScale("x", { min: span[0], max: span[1] });
      });
    },
    resize: () => plot.setSize({ width: Math.max(place.clientWidth, 120), height: HEIGHT_PX }),
    destroy: () => plot.destroy(),
  };
}

function series(curve) {
  return {
    label: curve.name,
    stroke: curve.colour,
    width: 1.75,
    spanGaps: false,
    points: { show: false },
  };
}

function axis(colours, size) {
  return {
    stroke: colours.muted,
    font: FONT,
    size,
    space: 44,
    grid: { stroke: colours.line, width: 1 },
    ticks: { show: false },
  };
}

/** Return the range of values to show: from zero, and never so narrow that noise fills it. */
export function range(low, high, curves) {
  const limits = curves.map((curve) => curve.limit).filter(Number.isFinite);
  const top = Math.max(high ?? 0, ...limits.filter((limit) => limit < 4 * (high || 1)));
  const bottom = Math.min(0, low ?? 0);
  return [bottom, (top || 1) * (1 + PAD_RATIO)];
}

/** Return a time of day; seconds only where the tick falls between two minutes. */
function clockWords(wall_s) {
  const at = new Date(1000 * wall_s);
  const second = at.getSeconds() ? "2-digit" : undefined;
  return at.toLocaleTimeString("en-GB", { hour: "2-digit", minute: "2-digit", second });
}

function drawLimits(plot, curves, colours) {
  const { ctx, bbox } = plot;
  ctx.save();
  ctx.setLineDash([6 * devicePixelRatio, 4 * devicePixelRatio]);
  ctx.lineWidth = 1.25 * devicePixelRatio;
  for (const limit of new Set(curves.map((curve) => curve.limit).filter(Number.isFinite))) {
    const y = Math.round(plot.valToPos(limit, "y", true));
    if (y < bbox.top || y > bbox.top + bbox.height) continue;
    const of = curves.filter((curve) => curve.limit === limit);
    ctx.strokeStyle = of.length === 1 && curves.length > 1 ? of[0].colour : colours.limit;
    ctx.beginPath();
    ctx.moveTo(bbox.left, y);
    ctx.lineTo(bbox.left + bbox.width, y);
    ctx.stroke();
  }
  ctx.restore();
}

function told(plot, curves, unit, digits) {
  const at = plot.cursor.idx;
  if (at === null || at === undefined) return null;
  return {
    time_s: plot.data[0][at],
    values: curves.map((curve, index) => written(plot.data[index + 1][at], unit, digits)),
  };
}

/** Return a value with its unit, or that it is missing. */
export function written(value, unit, digits) {
  if (value === null || value === undefined) return "missing";
  return `${value.toFixed(digits)} ${unit}`.trim();
}

function short(value, unit) {
  if (value >= 10000 && unit === "MB") return `${(value / 1000).toFixed(0)}k`;
  return String(Number(value.toPrecision(4)));
}
