/** Read how far apart control's ticks begin, and what of that is new. Pure. */

/** Return the bars of `period_ratio` {le, counts}: {from, to, count, share, late}; `to` null is open. */
export function barsOf({ le, counts }, late_ratio = 1.2) {
  const whole = counts.reduce((sum, count) => sum + count, 0);
  return counts.map((count, at) => ({
    from: at ? le[at - 1] : 0,
    to: le[at] ?? null,
    count,
    share: whole ? count / whole : 0,
    late: (le[at - 1] ?? 0) >= late_ratio,
  }));
}

/** Return counts since `before`, or all of them where control has been started anew. */
export function since(now, before) {
  if (!before || before.counts.length !== now.counts.length) return now;
  const grown = now.counts.map((count, at) => count - before.counts[at]);
  return grown.some((count) => count < 0) ? now : { ...now, counts: grown };
}

/** Return a bar's range in milliseconds, in words. */
export function rangeWords({ from, to }, period_s) {
  const written = (ratio) => (1000 * period_s * ratio).toFixed(2);
  if (to === null) return `over ${written(from)} ms`;
  return from === 0 ? `up to ${written(to)} ms` : `${written(from)} to ${written(to)} ms`;
}

/** Say the bars in one sentence. */
export function summaryOf(bars) {
  const whole = bars.reduce((sum, bar) => sum + bar.count, 0);
  const late = bars.filter((bar) => bar.late).reduce((sum, bar) => sum + bar.count, 0);
  if (whole === 0) return "No tick has been counted yet.";
  return `${whole.toLocaleString("en-GB")} ticks, ${late.toLocaleString("en-GB")} late (${((100 * late) / whole).toFixed(2)} %).`;
}
