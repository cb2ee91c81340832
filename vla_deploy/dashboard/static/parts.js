/** Offer the parts that views are built of. */

import { age, number } from "./format.js";
import { Icon } from "./icons.js";
import { may } from "./session.js";
import { html, useId } from "./ui.js";

/** A titled panel; `stale` and `age_s` mark what it shows as old, `wide` lets it span columns. */
export function Card({ title, note, stale, age_s, span, children, actions, label }) {
  const id = useId();
  return html`
    <section class="card" data-span=${span} data-stale=${stale ? "yes" : null} aria-labelledby=${id}>
      <header class="card-head">
        <h2 id=${id}>${title}</h2>
        ${label}
        ${note && html`<span class="quiet">${note}</span>`}
        <span class="grow"></span>
        ${stale !== undefined && html`<${Freshness} stale=${stale} age_s=${age_s} />`}
        ${actions}
      </header>
      <div class="card-body">${children}</div>
    </section>
  `;
}

/** Say that a value is old; nothing is said of one that is live. */
export function Freshness({ stale, age_s }) {
  if (!stale) return null;
  const told = age_s === null || age_s === undefined ? "no data" : `stale, ${age(age_s)}`;
  return html`<span class="stale-tag" title="Older than its deadline">${told}</span>`;
}

/** A number with its name and unit; `tone` is "ok", "warn" or "bad". */
export function Stat({ name, value, unit, digits, tone, note, stale }) {
  const shown = typeof value === "number" ? number(value, digits ?? 1) : (value ?? "–");
  return html`
    <div class="stat" data-tone=${tone} data-stale=${stale ? "yes" : null}>
      <dt>${name}</dt>
      <dd>
        <span class="stat-value">${shown}</span>${unit && html`<span class="unit">${unit}</span>`}
        ${note && html`<span class="quiet stat-note">${note}</span>`}
      </dd>
    </div>
  `;
}

/** A word in a coloured frame; the tone never says anything that the word does not. */
export function Badge({ tone = "quiet", icon, children }) {
  return html`
    <span class="badge" data-tone=${tone}>${icon && html`<${Icon} name=${icon} />`}${children}</span>
  `;
}

/** A link to where there is more. */
export function More({ href, children }) {
  return html`<a class="more" href=${href}>${children}<${Icon} name="chevron" /></a>`;
}

/** Say that there is nothing, and what would bring something. */
export function Empty({ icon, children }) {
  return html`<p class="empty">${icon && html`<${Icon} name=${icon} />`}<span>${children}</span></p>`;
}

/** Say something that stays until it no longer holds. */
export function Notice({ tone = "info", icon, children, actions }) {
  return html`
    <div class="notice" data-tone=${tone}>
      ${icon && html`<${Icon} name=${icon} />`}
      <div class="grow">${children}</div>
      ${actions}
    </div>
  `;
}

/** Say why an answer did not come. */
export function Failure({ error }) {
  return html`
    <${Notice} tone="bad" icon="alert">
      <p>${error.what ?? error.message}</p>
      ${error.advice && html`<p class="quiet">${error.advice}</p>`}
    <//>
  `;
}

/** A button; one that needs a role is off for others, and says why. */
export function Button({ kind = "usual", icon, needs, disabled, busy, title, children, ...rest }) {
  const lacks = needs && !may(needs);
  const why = lacks ? `Needs the role ${needs}` : title;
  return html`
    <button
      type="button"
      class="button"
      data-kind=${kind}
      disabled=${disabled || lacks || busy}
      aria-busy=${busy ? "true" : null}
      title=${why}
      ...${rest}
    >
      ${icon && html`<${Icon} name=${icon} />`}${children && html`<span>${children}</span>`}
    </button>
  `;
}

/** One of several choices, e.g. a span of time; `choices` is `[[value, words], ...]`. */
export function Choice({ name, choices, value, onChange }) {
  return html`
    <div class="choice" role="group" aria-label=${name}>
      ${choices.map(
        ([one, text]) => html`
          <button type="button" aria-pressed=${one === value ? "true" : "false"} onClick=${() => onChange(one)}>
            ${text}
          </button>
        `,
      )}
    </div>
  `;
}

/** A bar that is filled up to a share, with its limit marked. */
export function Bar({ ratio, limit_ratio, tone, name }) {
  const filled = Math.max(0, Math.min(1, ratio || 0));
  return html`
    <span
      class="bar"
      data-tone=${tone}
      role="meter"
      aria-label=${name}
      aria-valuemin="0"
      aria-valuemax="100"
      aria-valuenow=${Math.round(100 * filled)}
    >
      <span class="bar-fill" style=${{ inlineSize: `${100 * filled}%` }}></span>
      ${limit_ratio !== undefined && html`<span class="bar-limit" style=${{ insetInlineStart: `${100 * limit_ratio}%` }}></span>`}
    </span>
  `;
}
