/** Ask for user and password; the stop button needs neither. */

import { useAct } from "./asking.js";
import { login } from "./session.js";
import { html, useEffect, useRef, useState } from "./ui.js";

export function Login() {
  const [fault, setFault] = useState(null);
  const first = useRef(null);
  useEffect(() => first.current.focus(), []);
  const [send, isBusy] = useAct(async (form) => {
    setFault(null);
    try {
      await login(form.user.value.trim(), form.password.value);
    } catch (error) {
      setFault(error);
    }
  });
  const submit = (event) => {
    event.preventDefault();
    send(event.currentTarget);
  };
  return html`
    <main id="content" class="login" tabindex="-1">
      <form class="card login-card" onSubmit=${submit}>
        <img src="static/icon.svg" alt="" width="44" height="44" />
        <h1>Log in to the robot</h1>
        <div class="field">
          <label for="user">User</label>
          <input ref=${first} class="input" id="user" name="user" autocomplete="username" autocapitalize="none" required />
        </div>
        <div class="field">
          <label for="password">Password</label>
          <input class="input" id="password" name="password" type="password" autocomplete="current-password" required />
        </div>
        <div role="alert">
          ${fault && html`<p class="fault">${fault.what ?? fault.message}</p><p class="quiet small">${fault.advice}</p>`}
        </div>
        <button class="button" data-kind="main" type="submit" disabled=${isBusy} aria-busy=${isBusy}>Log in</button>
        <p class="quiet small">
          On the robot's own computer <code>vla-deploy dashboard</code> gives a link that logs you in, and
          <code>vla-deploy dashboard password</code> the first password. Anyone who sees this page can stop the robot;
          nobody moves it without logging in.
        </p>
      </form>
    </main>
  `;
}
