/** What the map shows, as text: for those who cannot see it, and for details of one thing. */

import { age, percent } from "../format.js";
import { html } from "../ui.js";

/** List the known things; the selected one shows what is known of it. */
export function MapList({ world, summary, selected, select }) {
  const chosen = world.objects.find((one) => one.id === selected);
  return html`
    <div class="map-list">
      <p id="map-told" class="quiet small">${summary}</p>
      ${world.objects.length > 0 &&
      html`
        <ul class="row" aria-label="Known things">
          ${world.objects.map(
            (one) => html`
              <li key=${one.id}>
                <button type="button" class="chip" aria-pressed=${one.id === selected ? "true" : "false"} onClick=${() => select(one.id === selected ? null : one)}>
                  <span class="swatch" data-thing=${one.colour} aria-hidden="true"></span>${one.name}
                </button>
              </li>
            `,
          )}
        </ul>
      `}
      ${chosen && html`<${Details} thing=${chosen} />`}
    </div>
  `;
}

function Details({ thing }) {
  const rows = [
    ["Known as", thing.id],
    ["Place", metres(thing.position_m)],
    ["Size", metres(thing.size_m)],
    ["How sure", percent(thing.confidence)],
    ["Seen", `${thing.seen_count} times${Number.isFinite(thing.age_s) ? `, ${age(thing.age_s)}` : ""}`],
    ["Rests", thing.on ? `on ${thing.on}` : null],
  ];
  return html`
    <dl class="details" aria-label=${`Details of ${thing.name}`}>
      ${rows.filter(([, value]) => value).map(([name, value]) => html`<dt>${name}</dt><dd>${value}</dd>`)}
    </dl>
  `;
}

function metres(vector) {
  return vector.map((value) => value.toFixed(2)).join(" × ") + " m";
}
