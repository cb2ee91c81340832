/** Hold a button, or the space bar on it, and talk to the robot; below it, what was understood. */

import { percent, sentence } from "../format.js";
import { useEvents, useTopic } from "../following.js";
import { Icon } from "../icons.js";
import { tell } from "../messages.js";
import { Badge, Bar, Freshness } from "../parts.js";
import { may } from "../session.js";
import { html, useEffect, useRef, useState } from "../ui.js";
import { openMicrophone, whyNoMicrophone } from "./microphone.js";

const VERDICTS = { accepted: "ok", doubted: "warn", rejected: "warn", stop: "bad" };
const KEYS = [" ", "Enter"];

export function HoldToTalk() {
  const [phase, setPhase] = useState("idle");
  const [level, setLevel] = useState(0);
  const microphone = useRef(null);
  const held = useRef(false);
  const why = whyNoMicrophone() || (may("operator") ? "" : "Needs the role operator.");

  const release = () => {
    held.current = false;
    microphone.current?.close();
    microphone.current = null;
    setPhase("idle");
    setLevel(0);
  };
  const ended = (why) => {
    release();
    if (why) tell("warn", `The robot no longer listens: ${why}`);
  };
  const press = async () => {
    if (why || held.current) return;
    held.current = true;
    setPhase("opening");
    try {
      const opened = await openMicrophone({ onLevel: setLevel, onEnd: ended });
      if (!held.current) return opened.close(); // it was let go meanwhile
      microphone.current = opened;
      setPhase("talking");
    } catch (error) {
      release();
      tell("bad", `No microphone: ${error.message}`, "Allow it for this page in the browser.");
    }
  };
  useEffect(() => release, []);

  return html`
    <div class="talk">
      <button
        type="button"
        class="button talk-button"
        data-phase=${phase}
        disabled=${Boolean(why)}
        aria-pressed=${phase === "idle" ? "false" : "true"}
        onPointerDown=${(event) => {
          event.currentTarget.setPointerCapture(event.pointerId);
          press();
        }}
        onPointerUp=${release}
        onPointerCancel=${release}
        onKeyDown=${(event) => KEYS.includes(event.key) && !event.repeat && (event.preventDefault(), press())}
        onKeyUp=${(event) => KEYS.includes(event.key) && release()}
        onBlur=${() => held.current && release()}
        onContextMenu=${(event) => event.preventDefault()}
      >
        <${Icon} name="microphone" />
        <span>${{ idle: "Hold to talk", opening: "Opening …", talking: "Listening, let go when done" }[phase]}</span>
      </button>
      ${phase === "talking" && html`<${Bar} name="Loudness" ratio=${Math.sqrt(level)} tone=${level > 0.98 ? "bad" : "ok"} />`}
      ${why && html`<p class="quiet small">${why}</p>`}
      <${Ears} />
      <${Heard} />
    </div>
  `;
}

/** Say whether the robot understands what is said, and why not. */
function Ears() {
  const { data, stale, age_s } = useTopic("speech_status");
  if (!data) return html`<p class="quiet small">The robot's speech process is silent.</p>`;
  const isDeaf = data.state === "deaf";
  return html`
    <p class="row small">
      <${Badge} tone=${isDeaf ? "warn" : "quiet"} icon="microphone">${sentence(data.state)}<//>
      ${data.speaking && html`<${Badge} tone="info" icon="speech">Speaks<//>`}
      ${isDeaf && html`<span class="quiet">${data.why}</span>`}
      <${Freshness} stale=${stale} age_s=${age_s} />
    </p>
  `;
}

/** Show the newest phrase that was heard, and what became of it. */
function Heard() {
  const [heard, setHeard] = useState(null);
  useEvents("heard", setHeard);
  if (!heard) return null;
  return html`
    <div class="heard" role="status" data-tone=${VERDICTS[heard.verdict] ?? "quiet"}>
      <p class="said-words">“${heard.text || "…"}”</p>
      <p class="row small">
        <span class="badge" data-tone=${VERDICTS[heard.verdict]}>${heard.verdict}</span>
        <span class="quiet">confidence ${percent(heard.confidence)}</span>
        ${heard.reason && html`<span>${heard.reason}</span>`}
      </p>
    </div>
  `;
}
