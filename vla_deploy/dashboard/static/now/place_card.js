/** Say where the robot is, how sure it is of that, and what it sees and hears. */

import { number, sentence, words } from "../format.js";
import { useTopic } from "../following.js";
import { Badge, Card, Empty, Stat } from "../parts.js";
import { html } from "../ui.js";

const RAD_TO_DEGREES = 180 / Math.PI;
const SURE = { tracking: "ok", unsure: "warn", lost: "bad" };
const STATES = ["tracking", "unsure", "lost"];

export function PlaceCard() {
  const { data, stale, age_s } = useTopic("pose");
  return html`
    <${Card} title="Place" stale=${stale} age_s=${age_s} label=${data && html`<${Sure} pose=${data} />`}>
      ${data ? html`<${Pose} pose=${data} />` : html`<${Empty}>Nobody tells where it is.<//>`}
    <//>
  `;
}

function Sure({ pose }) {
  const state = typeof pose.state === "number" ? STATES[pose.state] : pose.state;
  return html`<${Badge} tone=${SURE[state]}>${sentence(state)}<//>`;
}

function Pose({ pose }) {
  return html`
    <dl class="stats">
      <${Stat} name="x" value=${pose.x_m} unit="m" digits=${2} />
      <${Stat} name="y" value=${pose.y_m} unit="m" digits=${2} />
      <${Stat} name="Heading" value=${pose.yaw_rad * RAD_TO_DEGREES} unit="°" digits=${0} />
      <${Stat} name="Scan on map" value=${100 * pose.match_ratio} unit="%" digits=${0} />
    </dl>
  `;
}

export function SensesCard() {
  const scene = useTopic("scene");
  const speech = useTopic("speech_status");
  return html`
    <${Card} title="Senses" stale=${scene.stale} age_s=${scene.age_s}>
      <dl class="pairs">
        <div><dt>Sees</dt><dd>${seen(scene.data)}</dd></div>
        <div><dt>Hears</dt><dd>${hears(speech)}</dd></div>
        ${faults(scene.data).map((fault) => html`<div key=${fault}><dt>Image</dt><dd>${fault}</dd></div>`)}
      </dl>
    <//>
  `;
}

function seen(scene) {
  if (!scene) return "nothing: perception is silent";
  const things = scene.objects.map(({ colour, class: kind, position_m }) => {
    const [x, y] = position_m;
    return `${words(colour)} ${words(kind)} at ${number(x, 1)}, ${number(y, 1)}`;
  });
  const people = (scene.bystanders ?? []).map((one) => words(one.class));
  return [...things, ...people].join("; ") || "nothing";
}

function hears({ data, stale }) {
  if (!data || stale) return "nothing: speech is silent";
  return data.state === "deaf" ? `no words: ${data.why}` : words(data.state);
}

function faults(scene) {
  const away = Object.entries(scene?.away ?? {}).map(([sensor, why]) => `${words(sensor)}: ${why}`);
  return [...(scene?.image?.faults ?? []), ...away];
}
