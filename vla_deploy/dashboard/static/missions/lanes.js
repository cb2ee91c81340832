/** Lay out what each part of the robot did when: pure functions, drawn by the lane chart.
 *
 * A span is what one action of a mission did: its parts, from when to when in Unix seconds.
 */

const ORDER = ["base", "head", "camera", "left", "right", "speaker"];
const NO_PART = "no part";
const PX_PER_S = 8;
const MOST_PX = 4_000;
const WHOLE_PX = 240; // the least that a phone has; what is there is filled
const TICK_PX = 72;
const LABEL_PX = 36;
const STEPS_S = [1, 2, 5, 10, 15, 30, 60, 120, 300, 600, 1_800, 3_600, 7_200, 21_600, 86_400];
// How the actions of a part ended whose last words nobody noted.
const ENDS = { completed: "succeeded", failed: "aborted", cancelled: "cancelled" };

/** Return `{begin_s, end_s, width_px, ticks_s, lanes}` of a mission, or null before it did anything.
 *
 * A lane is `{part, rows, bars}`; a bar `{key, row, left, width, span}`, shares of the whole time.
 * With `isWhole` a long mission is not wider than a phone.
 */
export function lanesOf(mission, now_s, isWhole = false) {
  const spans = mission.spans.map((span, place) => ({ ...concluded(span, mission, now_s), key: place }));
  if (!spans.length) return null;
  const begin_s = Math.min(...spans.map((span) => span.begin_s));
  const end_s = Math.max(begin_s + 1, ...spans.map((span) => span.end_s));
  const names = new Set(spans.flatMap(partsOf));
  const lanes = [...names].toSorted(inOrder).map((part) => lane(part, spans, begin_s, end_s));
  const width_px = Math.min(Math.ceil((end_s - begin_s) * PX_PER_S), isWhole ? WHOLE_PX : MOST_PX);
  return { begin_s, end_s, width_px, ticks_s: ticks(end_s - begin_s, width_px), lanes };
}

/** Return the newest moment that missions tell of, by the robot's clock. */
export function newestMoment(missions) {
  const times = missions.flatMap((one) => [
    one.given_unix_s,
    ...one.spans.flatMap((span) => [span.begin_s, span.end_s]),
    ...[...Object.values(one.subtasks), ...Object.values(one.objectives)].flatMap((part) => [part.begin_s, part.end_s]),
  ]);
  return Math.max(0, ...times.filter(Number.isFinite));
}

/** Return a moment of a mission as minutes and seconds since its beginning: "2:05". */
export function sinceBegin(seconds) {
  const whole = Math.round(seconds);
  const [hours, minutes, rest] = [Math.floor(whole / 3600), Math.floor(whole / 60) % 60, whole % 60];
  const two = (value) => String(value).padStart(2, "0");
  return hours ? `${hours}:${two(minutes)}:${two(rest)}` : `${minutes}:${two(rest)}`;
}

/** Return a span with an end: now while it goes on, else when its part of the mission ended. */
function concluded(span, mission, now_s) {
  if (span.end_s !== null) return span;
  const part = mission.subtasks[span.subtask];
  const end_s = part?.end_s ?? now_s;
  const status = (part && ENDS[part.state]) ?? span.status;
  return { ...span, status, end_s: Math.max(span.begin_s, end_s) };
}

function partsOf(span) {
  return span.parts.length ? span.parts : [NO_PART];
}

function lane(part, spans, begin_s, end_s) {
  const whole_s = end_s - begin_s;
  const free_s = [];
  const own = spans.filter((span) => partsOf(span).includes(part)).toSorted((a, b) => a.begin_s - b.begin_s);
  const bars = own.map((span) => {
    const found = free_s.findIndex((free) => free <= span.begin_s);
    const row = found < 0 ? free_s.length : found;
    free_s[row] = span.end_s;
    return { key: span.key, row, left: (span.begin_s - begin_s) / whole_s, width: (span.end_s - span.begin_s) / whole_s, span };
  });
  return { part, rows: free_s.length, bars };
}

function ticks(whole_s, width_px) {
  const step_s = STEPS_S.find((one) => (one * width_px) / whole_s >= TICK_PX) ?? STEPS_S.at(-1);
  const last_s = whole_s * (1 - LABEL_PX / width_px); // what is written behind it has to fit
  return Array.from({ length: Math.floor(Math.max(last_s, 0) / step_s) + 1 }, (_, place) => place * step_s);
}

function inOrder(a, b) {
  const place = (name) => (ORDER.includes(name) ? ORDER.indexOf(name) : ORDER.length);
  return place(a) - place(b) || a.localeCompare(b);
}
