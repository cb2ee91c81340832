/** Ask before an act that matters. */

import { Button } from "./parts.js";
import { Store, useStore } from "./store.js";
import { html, useEffect, useRef } from "./ui.js";

const question = new Store(null);

/** Ask `{title, text, act, kind}` and return whether the user agreed; `text` may be a template. */
export function confirmed({ title, text, act, kind = "main" }) {
  question.value?.answer(false);
  return new Promise((answer) => question.set({ title, text, act, kind, answer }));
}

/** Draw the question that is open; rendered once, by the shell. */
export function Questions() {
  const asked = useStore(question);
  if (!asked) return null;
  const answer = (agreed) => {
    question.set(null);
    asked.answer(agreed);
  };
  return html`
    <${Dialog} title=${asked.title} onClose=${() => answer(false)}>
      <div>${asked.text}</div>
      <div class="dialog-acts">
        <${Button} onClick=${() => answer(false)}>Back<//>
        <${Button} kind=${asked.kind} onClick=${() => answer(true)}>${asked.act}<//>
      </div>
    <//>
  `;
}

/** A dialog in front of the page; Escape closes it.
 *
 * It is not modal by the browser's way, which would take the stop button away: the shell alone
 * goes out of reach while it is open.
 */
export function Dialog({ title, size, onClose, children }) {
  const box = useRef(null);
  useEffect(() => {
    const before = document.activeElement;
    const shell = document.querySelector(".shell");
    shell.inert = true;
    box.current.show();
    (box.current.querySelector("[autofocus]") ?? box.current.querySelector("button"))?.focus();
    return () => {
      shell.inert = false;
      before?.focus();
    };
  }, []);
  useEffect(() => {
    const escape = (event) => event.key === "Escape" && onClose();
    addEventListener("keydown", escape);
    return () => removeEventListener("keydown", escape);
  }, [onClose]);
  return html`
    <div class="veil" onClick=${onClose}></div>
    <dialog ref=${box} class="dialog" data-size=${size} aria-label=${title}>
      <h2>${title}</h2>
      ${children}
    </dialog>
  `;
}
