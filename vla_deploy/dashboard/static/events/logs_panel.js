/** Read the logs, the newest first: of one process or all, from a level on, as they go on. */

import { get } from "../api.js";
import { useAct, useAnswer } from "../asking.js";
import { clockExact, words } from "../format.js";
import { Button, Card, Choice, Empty, Failure } from "../parts.js";
import { html, useEffect, useState } from "../ui.js";

const LEVELS = [
  ["debug", "Debug"],
  ["info", "Info"],
  ["warning", "Warning"],
  ["error", "Error"],
];
const TONES = { WARNING: "warn", ERROR: "bad", CRITICAL: "bad", DEBUG: "quiet" };
const LIMIT = 200;
const FOLLOW_MS = 1_500;

export function LogsPanel() {
  const [filter, setFilter] = useState({ process: "", level: "info" });
  const [follows, setFollows] = useState(true);
  const [wanted, setWanted] = useState("");
  const query = new URLSearchParams({ ...filter, limit: LIMIT });
  const { data, error } = useAnswer(`logs?${query}`, follows ? FOLLOW_MS : 0);
  const [older, more, isBusy] = useOlder(data, query);
  const lines = [...(data?.lines ?? []), ...older].filter((line) => fits(line, wanted));
  return html`
    <${Card} title="Logs" note=${data ? `${lines.length} lines, the newest first` : ""}>
      <div class="log-tools">
        <${Processes} names=${data?.processes ?? []} value=${filter.process} onChange=${(process) => setFilter({ ...filter, process })} />
        <${Choice} name="Least level" choices=${LEVELS} value=${filter.level} onChange=${(level) => setFilter({ ...filter, level })} />
        <input class="input log-words" type="search" placeholder="Only lines with …" aria-label="Only lines with" value=${wanted} onInput=${(event) => setWanted(event.target.value)} />
        <label class="switch"><input type="checkbox" checked=${follows} onChange=${(event) => setFollows(event.target.checked)} />Follow</label>
      </div>
      ${error && html`<${Failure} error=${error} />`}
      ${data && lines.length === 0 && html`<${Empty}>No such line.<//>`}
      <ol class="log" aria-label="Log lines">${lines.map((line) => html`<${Line} key=${`${line.stamp_ns}-${line.process}-${line.message}`} line=${line} />`)}</ol>
      ${lines.length > 0 && html`<${Button} busy=${isBusy} onClick=${more}>Older lines<//>`}
    <//>
  `;
}

/** Return `[lines, more, isBusy]`: what was loaded beyond the newest lines of a query. */
function useOlder(data, query) {
  const [older, setOlder] = useState([]);
  const key = `${query.get("process")} ${query.get("level")}`;
  useEffect(() => setOlder([]), [key]);
  const [more, isBusy] = useAct(async () => {
    const last = older.at(-1) ?? data.lines.at(-1);
    query.set("before", last.stamp_ns);
    const told = await get(`logs?${query}`);
    setOlder([...older, ...told.lines]);
  });
  const least = data?.lines.at(-1)?.stamp_ns ?? Infinity;
  return [older.filter((line) => line.stamp_ns < least), more, isBusy];
}

function Processes({ names, value, onChange }) {
  return html`
    <select class="input" aria-label="Process" value=${value} onChange=${(event) => onChange(event.target.value)}>
      <option value="">All processes</option>
      ${names.map((name) => html`<option key=${name} value=${name}>${words(name)}</option>`)}
    </select>
  `;
}

function Line({ line }) {
  const level = String(line.level).toUpperCase();
  return html`
    <li class="log-line" data-tone=${TONES[level]}>
      <time class="quiet" datetime=${line.time}>${clockExact(Date.parse(line.time) / 1000)}</time>
      <span class="log-process">${line.process}</span>
      <span class="log-level">${level.toLowerCase()}</span>
      <span class="log-text">${line.message}${line.traceback && html`<pre>${line.traceback}</pre>`}</span>
    </li>
  `;
}

function fits(line, text) {
  const wanted = text.trim().toLowerCase();
  return !wanted || `${line.process} ${line.message}`.toLowerCase().includes(wanted);
}
