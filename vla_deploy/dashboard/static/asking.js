/** Let views ask the API and act. */

import { ApiError, get } from "./api.js";
import { tell } from "./messages.js";
import { useCallback, useEffect, useRef, useState } from "./ui.js";

/** Return `{data, error, again}` of a GET, asked once and every `period_ms` where that is given. */
export function useAnswer(path, period_ms = 0) {
  const [answer, setAnswer] = useState({ data: null, error: null });
  const asked = useRef(0);
  const again = useCallback(async () => {
    const number = ++asked.current;
    const told = await settled(get(path));
    if (number !== asked.current) return; // a newer question is under way
    setAnswer((before) => (told.error ? { ...before, error: told.error } : told));
  }, [path]);
  useEffect(() => {
    again();
    const timer = period_ms ? setInterval(again, period_ms) : 0;
    return () => {
      asked.current += 1;
      clearInterval(timer);
    };
  }, [again, period_ms]);
  return { ...answer, again };
}

/** Return `[act, isBusy]`: `act(...)` runs once at a time, and tells a failure to the user. */
export function useAct(act) {
  const [isBusy, setBusy] = useState(false);
  const run = async (...args) => {
    if (isBusy) return undefined;
    setBusy(true);
    const { data, error } = await settled(act(...args));
    setBusy(false);
    if (error) tell("bad", error.what ?? error.message, error.advice);
    return data;
  };
  return [run, isBusy];
}

async function settled(promise) {
  try {
    return { data: await promise, error: null };
  } catch (error) {
    if (!(error instanceof ApiError)) console.error(error); // a fault of the page's own
    return { data: null, error };
  }
}
