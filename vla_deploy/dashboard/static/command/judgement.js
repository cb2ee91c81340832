/** Show whether a goal can be reached as things stand: the robot measures, and nothing moves. */

import { get } from "../api.js";
import { sentence } from "../format.js";
import { Notice } from "../parts.js";
import { html } from "../ui.js";

const VERDICTS = {
  yes: ["ok", "check", "It can be done."],
  after_prerequisites: ["warn", "alert", "Something has to be done first."],
  no: ["bad", "alert", "It cannot be done as things stand."],
  unknown: ["info", null, "Nobody can tell yet."],
};
const LISTS = [
  ["prerequisites", "First"],
  ["obstacles", "In the way"],
  ["alternatives", "Instead"],
];

/** Return the judgement of a goal in words. */
export async function judge(goal) {
  const { task } = await get(`analysis?goal=${encodeURIComponent(goal)}`);
  return task;
}

export function Judgement({ task }) {
  const [tone, icon, verdict] = VERDICTS[task.feasible] ?? VERDICTS.unknown;
  const told = LISTS.filter(([name]) => task[name].length > 0);
  return html`
    <${Notice} tone=${tone} icon=${icon}>
      <p><strong>${verdict}</strong> ${task.reason && sentence(task.reason)}</p>
      ${told.map(([name, title]) => html`<p key=${name} class="quiet">${title}: ${task[name].join("; ")}</p>`)}
    <//>
  `;
}
