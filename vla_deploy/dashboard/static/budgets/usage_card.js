/** What every process uses of its budget now, and the whole robot of its own. */

import { useTopic } from "../following.js";
import { sentence } from "../format.js";
import { Badge, Bar, Card, Empty } from "../parts.js";
import { html } from "../ui.js";
import { METRICS, byProcess, toneOf, usedRatio, written } from "./lines.js";

/** Show the whole robot's lines, each as a bar against its limit. */
export function TotalCard() {
  const { data, stale, age_s } = useTopic("budget");
  const total = data && byProcess(data).find((one) => one.process === null);
  return html`
    <${Card} title="Whole robot" stale=${stale} age_s=${age_s} note="the twin counts in no total">
      ${total
        ? html`<div class="lines">${Object.values(total.lines).map((line) => html`<${Line} key=${line.metric} line=${line} />`)}</div>`
        : html`<${Empty} icon="gauge">The supervisor has told no budget yet.<//>`}
    <//>
  `;
}

function Line({ line }) {
  const name = METRICS[line.metric]?.words ?? sentence(line.metric);
  const ratio = usedRatio(line);
  return html`
    <div class="line" data-tone=${toneOf(line)}>
      <span class="line-name">${name}</span>
      <span class="line-value">${written(line)}</span>
      ${ratio !== null && html`<${Bar} ratio=${ratio} tone=${toneOf(line)} name=${`${name}, share of its limit`} />`}
    </div>
  `;
}

/** Show each process' CPU and memory against its lines. */
export function ProcessCard() {
  const { data, stale, age_s } = useTopic("budget");
  const rows = data ? byProcess(data).filter((one) => one.process !== null) : [];
  const enforced = new Map((data?.enforced ?? []).map((one) => [one.process, one]));
  return html`
    <${Card} title="Processes" span="2" stale=${stale} age_s=${age_s}>
      ${rows.length === 0
        ? html`<${Empty} icon="gauge">No process has been measured yet.<//>`
        : html`<${Processes} rows=${rows} enforced=${enforced} />`}
    <//>
  `;
}

function Processes({ rows, enforced }) {
  return html`
    <div class="scroll-x" tabindex="0" role="region" aria-label="Processes, scrollable">
      <table class="processes">
        <thead>
          <tr>
            ${["Process", "CPU", "Memory", "Stands", "Held to its limits by"].map((head) => html`<th scope="col">${head}</th>`)}
          </tr>
        </thead>
        <tbody>
          ${rows.map(({ process, lines }) => html`
            <tr key=${process}>
              <th scope="row">${process}</th>
              <td><${Cell} line=${lines.cpu_ratio} name=${`CPU of ${process}`} /></td>
              <td><${Cell} line=${lines.memory_mb} name=${`Memory of ${process}`} /></td>
              <td><${Standing} lines=${Object.values(lines)} /></td>
              <td class="quiet">${heldBy(enforced.get(process))}</td>
            </tr>
          `)}
        </tbody>
      </table>
    </div>
  `;
}

function Cell({ line, name }) {
  if (!line) return html`<span class="quiet">no limit</span>`;
  const ratio = usedRatio(line);
  return html`
    <span class="line-value">${written(line)}</span>
    ${ratio !== null && html`<${Bar} ratio=${ratio} tone=${toneOf(line)} name=${`${name}, share of its limit`} />`}
  `;
}

function Standing({ lines }) {
  const over = lines.filter((line) => line.over);
  if (over.length) return html`<${Badge} tone="bad" icon="alert">over ${over.map((line) => METRICS[line.metric]?.words).join(", ")}<//>`;
  const near = lines.some((line) => toneOf(line) === "warn");
  if (near) return html`<${Badge} tone="warn">near its limit<//>`;
  const missing = lines.some((line) => line.measured === null);
  return missing ? html`<${Badge}>not measured<//>` : html`<${Badge} tone="ok">within<//>`;
}

function heldBy(enforced) {
  if (!enforced) return "–";
  return enforced.cpu === enforced.memory ? enforced.cpu : `CPU: ${enforced.cpu}. Memory: ${enforced.memory}`;
}
