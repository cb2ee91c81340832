/** Draw bars whose counts span decades: the scale is logarithmic, an empty bar stays empty. */

const FOOT_PX = 30;
const HEAD_PX = 14;
const GAP_PX = 3;
const LEAST_PX = 2;
const FONT = "11px system-ui, sans-serif";

/** Draw `bars` {from, to, count, late}, labelled with their upper bounds in milliseconds. */
export function drawBars(context, size, bars, period_s, colours) {
  const most = Math.max(1, ...bars.map((bar) => bar.count));
  const wide = size.width / bars.length;
  const ground = size.height - FOOT_PX;
  context.font = FONT;
  context.textAlign = "center";
  bars.forEach((bar, at) => {
    const high = heightOf(bar.count, most, ground - HEAD_PX);
    const x = at * wide;
    context.fillStyle = bar.late ? colours.late : colours.bar;
    context.beginPath();
    context.roundRect(x + GAP_PX / 2, ground - high, wide - GAP_PX, high, [3, 3, 0, 0]);
    context.fill();
    context.fillStyle = colours.text;
    if (bar.count > 0) context.fillText(short(bar.count), x + wide / 2, ground - high - 4);
    context.fillText(boundWords(bar, period_s, wide), x + wide / 2, ground + 14);
  });
  context.fillStyle = colours.line;
  context.fillRect(0, ground, size.width, 1);
  context.fillStyle = colours.text;
  context.textAlign = "end";
  context.fillText("up to … ms", size.width, size.height - 2);
}

function heightOf(count, most, room_px) {
  if (count <= 0) return 0;
  return Math.max((room_px * Math.log10(1 + count)) / Math.log10(1 + most), LEAST_PX);
}

function boundWords({ to }, period_s, wide) {
  if (to === null) return "more";
  return (1000 * period_s * to).toFixed(wide < 34 ? 1 : 2).replace(/0$/, "");
}

function short(count) {
  return count < 10_000 ? String(count) : `${Math.round(count / 1000)}k`;
}
