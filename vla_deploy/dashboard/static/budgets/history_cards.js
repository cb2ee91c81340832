/** Curves of the last minute, ten minutes, hour or day, against their budget lines. */

import { useTopic } from "../following.js";
import { Choice, Failure } from "../parts.js";
import { html, useEffect, useMemo, useState } from "../ui.js";
import { ChartCard, MissingCard } from "./chart_card.js";
import { CHARTS, curvesOf } from "./charts.js";
import { SPANS, fetchHistory } from "./history.js";

/** Show every chart over the chosen span. */
export function HistoryCards() {
  const [span, setSpan] = useState(SPANS[1]);
  const { history, error } = useHistory(span);
  const budget = useTopic("budget").data;
  const board = useTopic("board").data;
  const choices = SPANS.map((one) => [one, one.words]);
  return html`
    <div class="view-head">
      <h2>Over time</h2>
      <span class="grow"></span>
      <${Choice} name="Span of time" choices=${choices} value=${span} onChange=${setSpan} />
    </div>
    ${error && html`<${Failure} error=${error} />`}
    ${history ? html`<${Charts} span_s=${span.span_s} history=${history} budget=${budget} board=${board} />` : html`<p class="empty" aria-busy="true">Asking for what was kept …</p>`}
  `;
}

function Charts({ span_s, history, budget, board }) {
  const drawn = useMemo(() => CHARTS.map((chart) => ({ chart, curves: curvesOf(chart, history) })), [history]);
  const known = drawn.filter(({ curves }) => curves.length > 0);
  const missing = drawn.filter(({ curves }) => curves.length === 0).map(({ chart }) => chart);
  return html`
    <div class="charts">
      ${known.map(
        ({ chart, curves }) => html`
          <${ChartCard} key=${chart.metric} chart=${chart} curves=${curves} span_s=${span_s} end_s=${history.end_s} budget=${budget} board=${board} />
        `,
      )}
      ${missing.length > 0 && html`<${MissingCard} charts=${missing} board=${board} history=${history} />`}
    </div>
  `;
}

/** Ask for the history again and again while the page is seen. */
function useHistory(span) {
  const [told, setTold] = useState({ history: null, error: null });
  useEffect(() => {
    let wanted = true;
    const ask = async () => {
      if (document.hidden) return;
      try {
        const history = await fetchHistory(CHARTS, span.span_s);
        if (wanted) setTold({ history, error: null });
      } catch (error) {
        if (wanted) setTold((before) => ({ ...before, error }));
      }
    };
    ask();
    const timer = setInterval(ask, span.again_ms);
    document.addEventListener("visibilitychange", ask);
    return () => {
      wanted = false;
      clearInterval(timer);
      document.removeEventListener("visibilitychange", ask);
    };
  }, [span]);
  return told;
}
