/** Write numbers and names for people. */

const UNKNOWN = "–";
const MINUTE_S = 60;
const HOUR_S = 3600;
const DAY_S = 86_400;

/** Return a number with so many digits behind the point, or a dash where there is none. */
export function number(value, digits = 1) {
  return Number.isFinite(value) ? value.toFixed(digits) : UNKNOWN;
}

/** Return a number with three significant digits: 0.0123, 1.23, 123. */
export function significant(value) {
  if (!Number.isFinite(value)) return UNKNOWN;
  const size = Math.abs(value);
  if (size !== 0 && (size < 0.001 || size >= 100_000)) return value.toExponential(2);
  return String(Number(value.toPrecision(3)));
}

/** Return a share as per cent. */
export function percent(ratio, digits = 0) {
  return Number.isFinite(ratio) ? `${(100 * ratio).toFixed(digits)} %` : UNKNOWN;
}

/** Return how long something takes or is ago: "120 ms", "3.2 s", "4 min", "2 h 5 min". */
export function duration(seconds) {
  if (!Number.isFinite(seconds)) return UNKNOWN;
  if (seconds < 1) return `${Math.round(1000 * seconds)} ms`;
  if (seconds < 10) return `${seconds.toFixed(1)} s`;
  if (seconds < 2 * MINUTE_S) return `${Math.round(seconds)} s`;
  if (seconds < HOUR_S) return `${Math.floor(seconds / MINUTE_S)} min`;
  if (seconds < DAY_S) return `${Math.floor(seconds / HOUR_S)} h ${Math.floor((seconds % HOUR_S) / MINUTE_S)} min`;
  return `${Math.floor(seconds / DAY_S)} d ${Math.floor((seconds % DAY_S) / HOUR_S)} h`;
}

/** Return an age that does not flicker: "now" below a second. */
export function age(seconds) {
  if (!Number.isFinite(seconds)) return UNKNOWN;
  return seconds < 1 ? "now" : `${duration(Math.floor(seconds))} ago`;
}

/** Return a size: "1.4 MB". */
export function bytes(count) {
  if (!Number.isFinite(count)) return UNKNOWN;
  const units = ["B", "kB", "MB", "GB", "TB"];
  const step = Math.min(Math.floor(Math.log10(Math.max(count, 1)) / 3), units.length - 1);
  const value = count / 1000 ** step;
  return `${value.toFixed(step && value < 100 ? 1 : 0)} ${units[step]}`;
}

/** Return a time of day of this device, with the date where it is another day. */
export function clock(wall_s) {
  if (!Number.isFinite(wall_s)) return UNKNOWN;
  const at = new Date(1000 * wall_s);
  const time = at.toLocaleTimeString("en-GB");
  const today = at.toDateString() === new Date().toDateString();
  return today ? time : `${at.toLocaleDateString("en-GB", { day: "numeric", month: "short" })} ${time}`;
}

/** Return a time of day with milliseconds. */
export function clockExact(wall_s) {
  if (!Number.isFinite(wall_s)) return UNKNOWN;
  const at = new Date(1000 * wall_s);
  return `${at.toLocaleTimeString("en-GB")}.${String(at.getMilliseconds()).padStart(3, "0")}`;
}

/** Return a name of the robot's as words: "joint_current_limit" is "joint current limit". */
export function words(name) {
  return String(name ?? "").replaceAll("_", " ");
}

/** Return words that begin a sentence. */
export function sentence(text) {
  const plain = words(text);
  return plain.charAt(0).toUpperCase() + plain.slice(1);
}
