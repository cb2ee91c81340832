/** Let what the robot carries out come to rest, and go on: all that goes on, not one command alone. */

import { post } from "../api.js";
import { useAct } from "../asking.js";
import { isStale, latest, subscribe } from "../live.js";
import { Button } from "../parts.js";
import { html, useEffect, useState } from "../ui.js";
import { STATES } from "./story.js";

const LOOK_PERIOD_MS = 500;

/** Return how a command stands, `{text, tone, icon}`: one that runs may be paused. */
export function standingOf(story, isPaused) {
  return isPaused && ["running", "mending"].includes(story.state) ? STATES.paused : STATES[story.state];
}

/** Return whether the executor says that it has paused. */
export function usePaused() {
  return useExecutorState() === "paused";
}

/** The button that pauses what goes on, or lets it go on; nothing where nothing goes on. */
export function PauseAct() {
  const state = useExecutorState();
  const isPaused = state === "paused";
  const [act, isBusy] = useAct(() => post(`commands/${isPaused ? "resume" : "pause"}`));
  if (state === "idle") return null;
  const title = isPaused ? "It goes on from where it stands" : "It comes to rest where it is, and holds what it holds";
  return html`
    <${Button} needs="operator" icon=${isPaused ? "play" : "pause"} busy=${isBusy} title=${title} onClick=${act}>${isPaused ? "Resume" : "Pause"}<//>
  `;
}

/** Return the executor's state; it is drawn anew on a change alone, not ten times a second. */
function useExecutorState() {
  const [state, setState] = useState(stateNow);
  useEffect(() => {
    const look = () => setState(stateNow());
    const end = subscribe("executor_status", look);
    const timer = setInterval(look, LOOK_PERIOD_MS);
    return () => {
      end();
      clearInterval(timer);
    };
  }, []);
  return state;
}

function stateNow() {
  const sample = latest("executor_status");
  return isStale(sample) ? "idle" : sample.data.state;
}
