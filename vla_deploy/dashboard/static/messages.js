/** Tell the user something in passing; it is read aloud by screen readers, too. */

import { Store, useStore } from "./store.js";
import { html } from "./ui.js";

const SHOWN_MS = { ok: 4_000, info: 5_000, warn: 8_000, bad: 12_000 };
const MOST = 4;

const messages = new Store([]);
let number = 0;

/** Show a message of a tone ("ok", "info", "warn", "bad"), with what to try below it. */
export function tell(tone, text, advice = "") {
  const message = { id: ++number, tone, text, advice };
  messages.set([...messages.value, message].slice(-MOST));
  setTimeout(() => take(message.id), SHOWN_MS[tone]);
}

/** Draw the messages; rendered once, into the live region of the page. */
export function Messages() {
  return useStore(messages).map(
    ({ id, tone, text, advice }) => html`
      <div key=${id} class="message" data-tone=${tone}>
        <div>
          <p>${text}</p>
          ${advice && html`<p class="quiet">${advice}</p>`}
        </div>
        <button type="button" class="plain" aria-label="Dismiss" onClick=${() => take(id)}>✕</button>
      </div>
    `,
  );
}

function take(id) {
  messages.set(messages.value.filter((one) => one.id !== id));
}
