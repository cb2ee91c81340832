/** Say that the page shows a file and no robot, and let one go about in it. */

import { post } from "./api.js";
import { useAct } from "./asking.js";
import { useTopic } from "./following.js";
import { Button, Notice } from "./parts.js";
import { html, useState } from "./ui.js";

const SPEEDS = [0.25, 0.5, 1, 2, 4, 8, 16];

export function ReplayBar() {
  const { data, stale } = useTopic("replay_status");
  if (!data || stale) return null;
  return html`
    <${Notice} tone="info" icon="record">
      <strong>Replay of ${data.file}.</strong> What you see was recorded; no robot is here, and none can be moved.
      <${Controls} told=${data} />
      ${data.refused && html`<p class="quiet">Refused: ${data.refused}</p>`}
    <//>
  `;
}

function Controls({ told }) {
  const [wound_s, setWound] = useState(null);
  const [ask, isBusy] = useAct((act, value = 0) => post("replay", { act, value }));
  const isStill = told.state !== "playing";
  const at_s = wound_s ?? told.position_s;
  const again = async () => {
    if (told.state === "ended") await ask("seek", 0);
    await ask("resume");
  };
  const wind = async (event) => {
    await ask("seek", Number(event.target.value));
    setWound(null);
  };
  return html`
    <div class="row replay">
      <${Button} needs="operator" icon=${isStill ? "play" : "pause"} busy=${isBusy} onClick=${isStill ? again : () => ask("pause")}>
        ${isStill ? "Play" : "Pause"}
      <//>
      <input
        class="grow"
        type="range"
        min="0"
        max=${told.duration_s}
        step="0.1"
        value=${at_s}
        aria-label="Moment of the recording"
        aria-valuetext=${place(at_s)}
        onInput=${(event) => setWound(Number(event.target.value))}
        onChange=${wind}
      />
      <span class="mono small">${place(at_s)} of ${place(told.duration_s)}</span>
      <select class="input" aria-label="Speed of the replay" value=${told.speed} onChange=${(event) => ask("speed", Number(event.target.value))}>
        ${speeds(told.speed).map((speed) => html`<option key=${speed} value=${speed}>${speed} ×</option>`)}
      </select>
    </div>
  `;
}

/** Return a moment as minutes and seconds. */
function place(at_s) {
  return `${Math.floor(at_s / 60)}:${(at_s % 60).toFixed(1).padStart(4, "0")}`;
}

/** Return what can be chosen, with the speed that was chosen elsewhere. */
function speeds(now) {
  return [...new Set([...SPEEDS, now])].sort((one, other) => one - other);
}
