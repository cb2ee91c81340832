/** Draw what each part of the robot did when: a lane for each part, and the same as a table. */

import { statusWords } from "../command/words.js";
import { clock, duration, sentence, words } from "../format.js";
import { Icon } from "../icons.js";
import { Choice } from "../parts.js";
import { html, useLayoutEffect, useRef, useState } from "../ui.js";
import { lanesOf, sinceBegin } from "./lanes.js";

const ROW_REM = 1.5;
const AT_END_PX = 24;
const LONG_S = 60;
const SCALES = [
  ["large", "Large"],
  ["whole", "Whole"],
];
const SIGNS = {
  active: ["info", "play"],
  succeeded: ["ok", "check"],
  cancelled: ["quiet", "cross"],
  aborted: ["bad", "alert"],
  rejected: ["bad", "alert"],
  lost: ["bad", "question"],
};

/** The lanes of a mission; `nameOf(subtask)` says what an action is for. */
export function LaneChart({ mission, now_s, nameOf, goesOn }) {
  const [scale, setScale] = useState("large");
  const drawn = lanesOf(mission, now_s, scale === "whole");
  const box = useFollowing(goesOn, drawn?.width_px);
  if (!drawn) return null;
  return html`
    <figure class="lane-chart">
      <figcaption>
        <span class="quiet small">What each part of the robot did, from ${clock(drawn.begin_s)} on</span>
        <span class="grow"></span>
        ${drawn.end_s - drawn.begin_s > LONG_S && html`<${Choice} name="Scale of time" choices=${SCALES} value=${scale} onChange=${setScale} />`}
      </figcaption>
      <div class="lanes" ref=${box} tabindex="0" role="region" aria-label="What each part did when for ${mission.mission.goal}, scrollable">
        <div class="lanes-inner" style=${{ minInlineSize: `calc(${drawn.width_px}px + var(--lane-name))` }}>
          <${Ticks} drawn=${drawn} />
          ${drawn.lanes.map((lane) => html`<${Lane} key=${lane.part} lane=${lane} drawn=${drawn} nameOf=${nameOf} />`)}
        </div>
      </div>
      <${Table} mission=${mission} drawn=${drawn} nameOf=${nameOf} />
    </figure>
  `;
}

function Ticks({ drawn }) {
  const whole_s = drawn.end_s - drawn.begin_s;
  return html`
    <div class="lane-ticks" aria-hidden="true">
      ${drawn.ticks_s.map(
        (at_s) => html`<span key=${at_s} class="lane-tick" style=${{ insetInlineStart: share(at_s / whole_s) }}>${sinceBegin(at_s)}</span>`,
      )}
    </div>
  `;
}

function Lane({ lane, drawn, nameOf }) {
  return html`
    <div class="lane">
      <span class="lane-name">${sentence(lane.part)}</span>
      <ul class="lane-track" aria-label=${sentence(lane.part)} style=${{ blockSize: `${lane.rows * ROW_REM}rem` }}>
        ${lane.bars.map((bar) => html`<${Bar} key=${bar.key} bar=${bar} drawn=${drawn} nameOf=${nameOf} />`)}
      </ul>
    </div>
  `;
}

function Bar({ bar, drawn, nameOf }) {
  const { span } = bar;
  const [tone, icon] = SIGNS[span.status] ?? SIGNS.active;
  const at = sinceBegin(span.begin_s - drawn.begin_s);
  const told = `${statusWords(span.status)}, from ${at}, ${duration(span.end_s - span.begin_s)}, for: ${nameOf(span.subtask)}`;
  const style = {
    insetInlineStart: share(bar.left),
    inlineSize: share(bar.width),
    insetBlockStart: `${bar.row * ROW_REM}rem`,
  };
  return html`
    <li class="lane-bar" data-tone=${tone} data-status=${span.status} style=${style} title=${`${words(span.skill)}: ${told}`}>
      <span class="lane-words"><${Icon} name=${icon} />${words(span.skill)}</span><span class="out-of-sight">: ${told}</span>
    </li>
  `;
}

function Table({ mission, drawn, nameOf }) {
  const [isOpen, setOpen] = useState(false);
  const spans = new Map(drawn.lanes.flatMap((lane) => lane.bars.map(({ span }) => [span.key, span])));
  const rows = [...spans.values()].toSorted((a, b) => a.begin_s - b.begin_s);
  return html`
    <details class="attempts" onToggle=${(event) => setOpen(event.currentTarget.open)}>
      <summary>As a table</summary>
      ${isOpen &&
      html`
        <div class="scroll-x" tabindex="0" role="region" aria-label="Actions of ${mission.mission.goal}, scrollable">
          <table>
            <thead>
              <tr>${["Action", "For", "Parts", "From", "Took", "How"].map((head) => html`<th scope="col">${head}</th>`)}</tr>
            </thead>
            <tbody>
              ${rows.map(
                (span) => html`
                  <tr key=${span.key}>
                    <th scope="row">${words(span.skill)}</th>
                    <td>${nameOf(span.subtask)}</td>
                    <td>${span.parts.join(", ") || "none"}</td>
                    <td>${sinceBegin(span.begin_s - drawn.begin_s)}</td>
                    <td>${duration(span.end_s - span.begin_s)}</td>
                    <td>${statusWords(span.status)}</td>
                  </tr>
                `,
              )}
            </tbody>
          </table>
        </div>
      `}
    </details>
  `;
}

/** Keep the newest in sight while a mission goes on, unless somebody has scrolled back. */
function useFollowing(goesOn, width_px) {
  const box = useRef(null);
  const wasAtEnd = useRef(true);
  useLayoutEffect(() => {
    const shown = box.current;
    if (!shown) return undefined;
    const scrolled = () => {
      wasAtEnd.current = shown.scrollLeft + shown.clientWidth >= shown.scrollWidth - AT_END_PX;
    };
    shown.addEventListener("scroll", scrolled, { passive: true });
    return () => shown.removeEventListener("scroll", scrolled);
  }, [Boolean(width_px)]);
  useLayoutEffect(() => {
    if (goesOn && wasAtEnd.current && box.current) box.current.scrollLeft = box.current.scrollWidth;
  }, [goesOn, width_px]);
  return box;
}

function share(ratio) {
  return `${(100 * ratio).toFixed(3)}%`;
}
