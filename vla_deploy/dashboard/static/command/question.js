/** Let the person answer what the robot asks: a choice, or words. */

import { post } from "../api.js";
import { useAct } from "../asking.js";
import { Icon } from "../icons.js";
import { Button } from "../parts.js";
import { html, useState } from "../ui.js";
import { Timeline } from "./timeline.js";

export function Question({ asked }) {
  const [words, setWords] = useState("");
  const [answer, isBusy] = useAct((text) => post("commands/answer", { text }));
  const offered = asked.choices?.length ? asked.choices : asked.plan ? ["yes"] : [];
  const choices = [...offered, "no"]; // what is asked for may be none of it
  const submit = (event) => {
    event.preventDefault();
    if (words.trim()) answer(words.trim());
  };
  return html`
    <section class="question" aria-label="The robot asks" data-tone="warn">
      <p class="question-words" role="alert"><${Icon} name="question" /><span>${asked.question}</span></p>
      ${asked.plan && html`<${Timeline} actions=${asked.plan.actions.map((action) => ({ ...action, status: "pending" }))} />`}
      <div class="row">
        ${choices.map(
          (choice) => html`<${Button} needs="operator" busy=${isBusy} onClick=${() => answer(choice)}>${choice}<//>`,
        )}
      </div>
      <form class="row" onSubmit=${submit}>
        <input
          class="input grow"
          aria-label="Answer in words"
          placeholder="or answer in words"
          value=${words}
          maxlength="1000"
          onInput=${(event) => setWords(event.target.value)}
        />
        <button class="button" type="submit" disabled=${!words.trim() || isBusy}>Answer</button>
      </form>
      ${asked.answer_within_s && html`<p class="quiet small">Unanswered, it is dropped after ${Math.round(asked.answer_within_s)} s.</p>`}
    </section>
  `;
}
