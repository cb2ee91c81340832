/** Start the page: who are we, then what the robot tells. */

import { Questions } from "./dialog.js";
import { connect, disconnect, subscribe } from "./live.js";
import { Login } from "./login.js";
import { Messages, tell } from "./messages.js";
import { followLink, refresh, useSession } from "./session.js";
import { Shell } from "./shell.js";
import { saw } from "./stop.js";
import { html, render, useEffect } from "./ui.js";

const AGAIN_MS = 2_000;

function Page() {
  const session = useSession();
  const shut = session === null || session.login_needed;
  useEffect(() => (shut ? disconnect() : connect()), [shut]);
  if (session === null) return html`<p class="no-script" aria-busy="true">Asking the robot …</p>`;
  return session.login_needed ? html`<${Login} />` : html`<${Shell} /><${Questions} />`;
}

async function begin() {
  try {
    await followLink();
  } catch (error) {
    tell("bad", error.what ?? error.message, error.advice);
  }
  try {
    await refresh();
  } catch (error) {
    tell("bad", error.what ?? error.message, error.advice);
    setTimeout(begin, AGAIN_MS);
  }
}

render(html`<${Page} />`, document.getElementById("application"));
render(html`<${Messages} />`, document.getElementById("messages"));
subscribe("control_status", ({ data }) => saw(data));
addEventListener("hashchange", () => {
  if (location.hash.startsWith("#/login/")) begin();
});
begin();
