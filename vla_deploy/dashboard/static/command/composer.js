/** Give a command: type it, say it, or paste a plan or a mission. */

import { post } from "../api.js";
import { useAct } from "../asking.js";
import { tell } from "../messages.js";
import { Button, Card } from "../parts.js";
import { may } from "../session.js";
import { html, useState } from "../ui.js";
import { HoldToTalk } from "./hold_to_talk.js";
import { Judgement, judge } from "./judgement.js";

const MOST_CHARACTERS = 1000;
const EXAMPLES = ["go to the kitchen", "pick up the red cup and put it in the box", "come back"];

export function Composer() {
  const [text, setText] = useState("");
  const [give, isBusy] = useAct(async (words) => {
    await post("commands", { text: words });
    write("");
  });
  const [task, setTask] = useState(null);
  const [ask, isAsking] = useAct(async (words) => setTask(await judge(words)));
  const write = (words) => {
    setText(words);
    setTask(null); // it judged other words
  };
  const submit = (event) => {
    event.preventDefault();
    if (text.trim()) give(text.trim());
  };
  return html`
    <${Card} title="Give a command">
      <div class="stack">
        <form class="composer" onSubmit=${submit}>
          <input
            id="command-text"
            class="input"
            aria-label="Command in words"
            placeholder="Say what it shall do"
            autocomplete="off"
            enterkeyhint="send"
            maxlength=${MOST_CHARACTERS}
            value=${text}
            disabled=${!may("operator")}
            onInput=${(event) => write(event.target.value)}
          />
          <button class="button" data-kind="main" type="submit" disabled=${!text.trim() || isBusy || !may("operator")}>Send</button>
        </form>
        ${task && html`<${Judgement} task=${task} />`}
        <${HoldToTalk} />
        <div class="row examples" aria-label="Examples">
          ${EXAMPLES.map((one) => html`<button type="button" class="chip" onClick=${() => write(one)}>${one}</button>`)}
          <span class="grow"></span>
          <${Button} disabled=${!text.trim()} busy=${isAsking} onClick=${() => ask(text.trim())} title="Measure whether it can be done; nothing moves">Could you?<//>
        </div>
        <${PlanField} />
      </div>
    <//>
  `;
}

function PlanField() {
  const [text, setText] = useState("");
  const [send, isBusy] = useAct((given) => (isMission(given) ? post("missions", given) : post("commands", { plan: given })));
  const submit = (event) => {
    event.preventDefault();
    const plan = readPlan(text);
    if (plan) send(plan);
  };
  return html`
    <details class="plan-field">
      <summary>Give a plan or a mission as JSON</summary>
      <form class="stack" onSubmit=${submit}>
        <textarea
          class="input mono"
          rows="6"
          aria-label="Plan or mission as JSON"
          spellcheck="false"
          placeholder=${'{"goal": "greet", "actions": [{"id": "a1", "skill": "speak", "parameters": {"text": "hello"}}]}'}
          value=${text}
          onInput=${(event) => setText(event.target.value)}
        ></textarea>
        <div class="row">
          <button class="button" type="submit" disabled=${!text.trim() || isBusy || !may("operator")}>Check it, then run it</button>
        </div>
      </form>
    </details>
  `;
}

/** A mission has objectives, as no plan has; a list of words is one, too. */
function isMission(given) {
  return Array.isArray(given) || Boolean(given?.objectives);
}

function readPlan(text) {
  try {
    return JSON.parse(text);
  } catch (error) {
    tell("bad", `This is no JSON: ${error.message}`, "Expected a plan with goal and actions, or a mission with goal and objectives.");
    return null;
  }
}
