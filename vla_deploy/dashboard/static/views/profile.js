/** See what the computer was taken for, what runs on it, and take the robot to another profile. */

import { useAnswer } from "../asking.js";
import { useTopic } from "../following.js";
import { Badge, Card, Empty, Failure, Notice } from "../parts.js";
import { DifferenceCard } from "../profile/difference_card.js";
import { ProgressCard } from "../profile/progress_card.js";
import { html, useState } from "../ui.js";

const AGAIN_MS = 15_000;

export function View() {
  const { data, error } = useAnswer("profile", AGAIN_MS);
  const live = useTopic("profile_status");
  const current = live.data ?? data?.current ?? null;
  const [wanted, want] = useState(null);
  const [request, ask] = useState(null);
  return html`
    <div class="view-head"><h1>Profile</h1></div>
    ${error && html`<${Failure} error=${error} />`}
    <div class="profile-view">
      <div class="stack">
        <${CurrentCard} current=${current} live=${live} detected=${data?.detected} />
        <${ProgressCard} current=${current} request=${request} />
        <${ListCard} profiles=${data?.available} current=${current?.profile} wanted=${wanted} want=${want} />
      </div>
      <${DifferenceCard} wanted=${wanted} current=${current} onAsked=${ask} />
    </div>
  `;
}

function CurrentCard({ current, live, detected }) {
  const fits = detected && current && detected.name === current.profile;
  return html`
    <${Card} title="This computer" stale=${live.stale} age_s=${live.age_s}>
      ${current?.fault && html`<${Notice} tone="warn" icon="alert">${current.fault}<//>`}
      <dl class="facts">
        <dt>In force</dt>
        <dd><strong>${current?.profile ?? "unknown"}</strong></dd>
        <dt>Detected</dt>
        <dd>
          <strong>${detected?.name ?? "asking …"}</strong>
          ${fits === true && html` <${Badge} tone="ok" icon="check">in force<//>`}
          ${fits === false && html` <${Badge} tone="warn">another one is in force<//>`}
        </dd>
        <dt>How</dt>
        <dd>${detected ? html`<${Reasons} why=${detected.why} />` : "–"}</dd>
      </dl>
    <//>
  `;
}

function Reasons({ why }) {
  const parts = why.split("; ");
  if (parts.length === 1) return why;
  return html`<ul class="reasons">${parts.map((part) => html`<li>${part}</li>`)}</ul>`;
}

function ListCard({ profiles, current, wanted, want }) {
  return html`
    <${Card} title="Profiles" note=${profiles ? `${profiles.length} for boards that it knows` : ""}>
      ${profiles ? null : html`<${Empty} icon="sliders">Asking for the list …<//>`}
      <ul class="profiles">
        ${(profiles ?? []).map(
          (one) => html`
            <li key=${one.name}>
              <button type="button" class="profile" aria-pressed=${one.name === wanted ? "true" : "false"} onClick=${() => want(one.name)}>
                <span class="grow">
                  <span class="profile-name">${one.name}</span>
                  ${one.inherits?.length > 0 && html`<span class="quiet small">on top of ${[one.inherits].flat().join(", ")}</span>`}
                </span>
                ${one.fits && html`<${Badge} tone="info">fits<//>`}
                ${one.name === current && html`<${Badge} tone="ok">in force<//>`}
              </button>
            </li>
          `,
        )}
      </ul>
    <//>
  `;
}
