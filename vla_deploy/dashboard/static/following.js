/** Let views follow live topics. */

import { ageOf, connection, isStale, latest, subscribe } from "./live.js";
import { useStore } from "./store.js";
import { useEffect, useRef, useState } from "./ui.js";

const LOOK_PERIOD_MS = 500;

/** Return how the live connection is. */
export function useConnection() {
  return useStore(connection);
}

/** Draw again every now and then, since ages grow while nothing comes. */
export function useTicking(period_ms = LOOK_PERIOD_MS) {
  const [, draw] = useState(0);
  useEffect(() => {
    const timer = setInterval(() => draw((count) => count + 1), period_ms);
    return () => clearInterval(timer);
  }, [period_ms]);
}

/** Return the newest value of a topic: `{data, age_s, stale}`; `data` is null before the first.
 *
 * It draws at most once per picture of the screen, and when the value becomes stale.
 */
export function useTopic(topic) {
  const [, draw] = useState(0);
  useTicking();
  useStore(connection);
  useEffect(() => {
    let frame = 0;
    const drawOnce = () => {
      frame = 0;
      draw((count) => count + 1);
    };
    const end = subscribe(topic, () => (frame ||= requestAnimationFrame(drawOnce)));
    return () => {
      end();
      cancelAnimationFrame(frame);
    };
  }, [topic]);
  const sample = latest(topic);
  if (!sample) return { data: null, age_s: null, stale: true };
  return { data: sample.data, age_s: ageOf(sample), stale: isStale(sample) };
}

/** Call `listener(data, sample)` for every event of a topic while the view is there. */
export function useEvents(topic, listener) {
  const newest = useRef(listener);
  newest.current = listener;
  useEffect(() => subscribe(topic, (sample) => newest.current(sample.data, sample)), [topic]);
}
