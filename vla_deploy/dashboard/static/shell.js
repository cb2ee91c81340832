/** Stand around every view: head with name and safety state, navigation, notices, content. */

import { usePaused } from "./command/pause.js";
import { useAlarms } from "./events/alarms.js";
import { duration } from "./format.js";
import { useConnection, useTicking, useTopic } from "./following.js";
import { Icon } from "./icons.js";
import { Notice } from "./parts.js";
import { ReplayBar } from "./replay_bar.js";
import { ROUTES, useRoute } from "./router.js";
import { safetyWords } from "./safety_words.js";
import { logout, useSession } from "./session.js";
import { useStore } from "./store.js";
import { nextTheme, theme } from "./theme.js";
import { html, useEffect, useRef } from "./ui.js";
import { ViewPlace } from "./view_place.js";

const GONE_AFTER_MS = 1_500;
const THEME_ICONS = { auto: "contrast", light: "sun", dark: "moon" };

export function Shell() {
  const route = useRoute();
  const content = useRef(null);
  const first = useRef(true);
  useEffect(() => {
    document.title = `${route.title} · robot`;
    if (!first.current) content.current.focus({ preventScroll: false });
    first.current = false;
  }, [route.name]);
  return html`
    <div class="shell">
      <${Head} />
      <${Navigation} here=${route.name} />
      <main id="content" class="content" ref=${content} tabindex="-1">
        <${Gone} />
        <${ReplayBar} />
        <${ViewPlace} key=${route.name} route=${route} />
      </main>
    </div>
  `;
}

function Head() {
  const table = useTopic("process_table").data;
  return html`
    <header class="top">
      <a class="brand" href="#/now">
        <img src="static/icon.svg" alt="" />
        <span class="brand-name">${table?.robot ?? "Robot"}</span>
        ${table?.twin && html`<span class="badge" data-tone="info">twin</span>`}
      </a>
      <${SafetyPill} />
      <${Activity} />
      <span class="grow"></span>
      <${Connection} />
      <${ThemeSwitch} />
      <${User} />
    </header>
  `;
}

function SafetyPill() {
  const { data, stale } = useTopic("control_status");
  const told = safetyWords(data, stale);
  return html`
    <a class="state-pill" href="#/now" data-tone=${told.tone}>
      <${Icon} name=${told.icon} /><span class="out-of-sight">Safety state:${" "}</span><span>${told.title}</span>
      ${told.cause && html`${" "}<span class="cause">${told.cause}</span>`}
    </a>
  `;
}

/** Say in one word what the robot does; the safety state beside it says why it is stopped. */
function Activity() {
  const { data, stale } = useTopic("activity");
  const isPaused = usePaused();
  const word = !data || stale ? "unknown" : isPaused && data.activity !== "stopped" ? "paused" : data.activity;
  return html`
    <span class="activity" title=${data?.stopped_by || null}>
      <span class="out-of-sight">The robot is:${" "}</span>${word}
    </span>
  `;
}

function Connection() {
  const { state } = useConnection();
  const [tone, text] = { open: ["ok", "Live"], connecting: ["warn", "Connecting"], closed: ["bad", "Offline"] }[state];
  return html`
    <span class="connection" data-tone=${tone} role="status" aria-label="Connection: ${text}">
      <span class="dot" data-hollow=${state === "open" ? null : "yes"}></span>
      <span class="connection-words">${text}</span>
    </span>
  `;
}

function ThemeSwitch() {
  const choice = useStore(theme);
  return html`
    <button type="button" class="button" data-kind="icon" onClick=${nextTheme} title="Colours: ${choice}" aria-label="Colours: ${choice}">
      <${Icon} name=${THEME_ICONS[choice]} />
    </button>
  `;
}

function User() {
  const session = useSession();
  if (session?.way !== "session") return null;
  return html`
    <button type="button" class="button" data-kind="plain" onClick=${logout} title="Log out">
      <span class="user-name">${session.user} · ${session.role}</span><${Icon} name="leave" />
      <span class="out-of-sight">Log out</span>
    </button>
  `;
}

function Navigation({ here }) {
  const open = useAlarms().open.length;
  return html`
    <nav class="nav" aria-label="Views">
      ${ROUTES.map(
        ({ name, title, icon }) => html`
          <a key=${name} href="#/${name}" aria-current=${name === here ? "page" : null}>
            <${Icon} name=${icon} /><span>${title}</span>
            ${name === "events" && open > 0 && html`<span class="count" aria-label="${open} open alarms">${open}</span>`}
          </a>
        `,
      )}
    </nav>
  `;
}

/** Say that the page shows the past, from the moment on when it does. */
function Gone() {
  useTicking();
  const { state, heard_ms } = useConnection();
  const gone_ms = performance.now() - (heard_ms ?? 0);
  if (state === "open" || gone_ms < GONE_AFTER_MS) return null;
  const since = heard_ms === null ? "No live data yet." : `No live data for ${duration(gone_ms / 1000)}.`;
  return html`
    <${Notice} tone="bad" icon="wifi">
      <strong>${since}</strong> What you see is old. The stop button works by a way of its own; the page connects again by itself.
    <//>
  `;
}
