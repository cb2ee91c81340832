/** The joints as a table: where each is, where it should be, and how its servo fares. */

import { percent, words } from "../format.js";
import { Badge, Card, Empty } from "../parts.js";
import { useSampled } from "../sampled.js";
import { html } from "../ui.js";
import { effortTone, rangeRatio, rowsOf, written } from "./joint_values.js";

const HEADS = [
  ["Joint", null],
  ["Position", "numeric"],
  ["In its range", "travel-cell"],
  ["Setpoint", "numeric"],
  ["Velocity", "numeric"],
  ["Effort", "numeric"],
  ["Temperature", "numeric"],
  ["Torque", "numeric"],
  ["Errors", "numeric"],
];

/** Show every joint; `joints` maps a name to its kind and range. */
export function JointTable({ joints, chosen, onChoose }) {
  const state = useSampled("joint_state");
  const slow = useSampled("control_status", 1000).data?.joints;
  const rows = state.data ? rowsOf(state.data, joints, slow) : [];
  return html`
    <${Card} title="Joints" span="all" stale=${state.stale} age_s=${state.age_s} note=${summary(rows)}>
      ${rows.length === 0
        ? html`<${Empty} icon="robot">No joint has been read yet.<//>`
        : html`<${Table} rows=${rows} chosen=${chosen} onChoose=${onChoose} />`}
    <//>
  `;
}

function Table({ rows, chosen, onChoose }) {
  return html`
    <div class="scroll-x" tabindex="0" role="region" aria-label="Joints, scrollable">
      <table class="joints">
        <thead>
          <tr>
            ${HEADS.map(([head, kind]) => html`<th scope="col" class=${kind}>${head}</th>`)}
          </tr>
        </thead>
        <tbody>
          ${rows.map((row) => html`<${Row} key=${row.name} row=${row} chosen=${row.name === chosen} onChoose=${onChoose} />`)}
        </tbody>
      </table>
    </div>
  `;
}

function Row({ row, chosen, onChoose }) {
  const { writing } = row;
  return html`
    <tr data-chosen=${chosen ? "yes" : null}>
      <th scope="row">
        <button type="button" class="row-name" aria-pressed=${chosen ? "true" : "false"} onClick=${() => onChoose(chosen ? null : row.name)}>
          ${words(row.name)}
        </button>
      </th>
      <td class="numeric">${written(row.position, writing)}<span class="unit">${writing.unit}</span></td>
      <td class="travel-cell"><${Travel} row=${row} /></td>
      <td class="numeric">${written(row.setpoint, writing)}<span class="unit">${writing.unit}</span></td>
      <td class="numeric">${written(row.velocity, writing)}<span class="unit">${writing.rate}</span></td>
      <td class="numeric" data-tone=${effortTone(row.effort_ratio)}>${effort(row)}</td>
      <td class="numeric">${temperature(row)}</td>
      <td class="numeric">${row.torque ? html`<${Badge} tone="ok">on<//>` : html`<${Badge}>off<//>`}</td>
      <td class="numeric">${row.errors.length ? html`<${Badge} tone="bad">${row.errors.join(", ")}<//>` : html`<span class="quiet">none</span>`}</td>
    </tr>
  `;
}

function Travel({ row }) {
  const at = rangeRatio(row.position, row.range);
  const goal = rangeRatio(row.setpoint, row.range);
  if (at === null) return html`<span class="quiet">–</span>`;
  return html`
    <span class="travel" aria-hidden="true">
      <span class="travel-goal" style=${{ insetInlineStart: `${100 * goal}%` }}></span>
      <span class="travel-at" style=${{ insetInlineStart: `${100 * at}%` }}></span>
    </span>
    <span class="out-of-sight">${percent(at)} of its range</span>
  `;
}

function effort(row) {
  const share = percent(row.effort_ratio);
  return row.current_a === null ? share : html`${share} <span class="quiet">${row.current_a.toFixed(2)} A</span>`;
}

function temperature({ temperature_c }) {
  if (temperature_c !== null) return html`${temperature_c.toFixed(0)}<span class="unit">°C</span>`;
  return html`<span class="quiet" title="The servo has not told it yet">missing</span>`;
}

function summary(rows) {
  if (rows.length === 0) return "";
  const faulty = rows.filter((row) => row.errors.length > 0).length;
  const powered = rows.filter((row) => row.torque).length;
  return `${rows.length} joints, ${powered} with torque, ${faulty ? `${faulty} with errors` : "no errors"}`;
}
