/** Lease the robot to AI agents for some minutes, and take the lease back. */

import { post } from "../api.js";
import { useAct, useAnswer } from "../asking.js";
import { confirmed } from "../dialog.js";
import { Badge, Button, Card, Choice, Failure } from "../parts.js";
import { html, useState } from "../ui.js";

const AGAIN_MS = 3000;
const MINUTES = [5, 10, 30, 60];

export function AgentsCard() {
  const { data, error, again } = useAnswer("agents/lease", AGAIN_MS);
  const [minutes, choose] = useState(MINUTES[1]);
  const [grant, granting] = useAct(async () => {
    if (!(await agreed(minutes))) return;
    await post("agents/lease", { minutes });
    await again();
  });
  const [revoke, revoking] = useAct(async () => {
    await post("agents/revoke");
    await again();
  });
  return html`
    <${Card} title="AI agents" label=${data && html`<${State} lease=${data} />`}>
      ${error && html`<${Failure} error=${error} />`}
      <p class="quiet">${words(data)}</p>
      <div class="row acts">
        ${!data?.may_act && html`<${Choice} name="Minutes" choices=${MINUTES.map((one) => [one, `${one} min`])} value=${minutes} onChange=${choose} />`}
        ${!data?.may_act && html`<${Button} needs="admin" busy=${granting} onClick=${grant}>Lease the robot<//>`}
        ${data?.may_act && html`<${Button} needs="operator" busy=${revoking} onClick=${revoke}>Take it back<//>`}
      </div>
    <//>
  `;
}

function State({ lease }) {
  return lease.may_act ? html`<${Badge} tone="warn">may give commands<//>` : html`<${Badge}>may read and stop<//>`;
}

function words(lease) {
  if (!lease) return "Asking …";
  if (!lease.may_act) return "Agents may read and stop. They act only while a person has leased them the robot.";
  return `Agents may give commands for ${Math.ceil(lease.left_s / 60)} min yet, by leave of ${lease.granted_by}.`;
}

function agreed(minutes) {
  return confirmed({
    title: `Lease the robot to agents for ${minutes} minutes?`,
    text: "They may have it drive and grasp. Validator and safety judge it as always; the robot's questions are yours to answer.",
    act: "Lease",
  });
}
