/** Let tables follow fast topics at a pace that people can read. */

import { ageOf, isStale, latest, subscribe } from "./live.js";
import { useEffect, useState } from "./ui.js";

/** Return `{data, age_s, stale}` of a topic, looked at every `period_ms` while the page is seen. */
export function useSampled(topic, period_ms = 250) {
  const [, draw] = useState(0);
  useEffect(() => {
    const end = subscribe(topic, () => {});
    const timer = setInterval(() => document.hidden || draw((count) => count + 1), period_ms);
    return () => {
      end();
      clearInterval(timer);
    };
  }, [topic, period_ms]);
  const sample = latest(topic);
  if (!sample) return { data: null, age_s: null, stale: true };
  return { data: sample.data, age_s: ageOf(sample), stale: isStale(sample) };
}
