/** Load a view when it is first gone to, and keep a fault in one view from taking the page along. */

import { Notice } from "./parts.js";
import { html, useEffect, useErrorBoundary, useState } from "./ui.js";

/** The place where the view of a route stands. */
export function ViewPlace({ route }) {
  const [view, setView] = useState({});
  const [fault, retry] = useErrorBoundary((error) => console.error(error));
  useEffect(() => {
    let wanted = true;
    route.load().then(
      (loaded) => wanted && setView({ View: loaded.View }),
      (error) => wanted && setView({ error }),
    );
    return () => {
      wanted = false;
    };
  }, []);
  if (fault || view.error) return html`<${Broken} title=${route.title} error=${fault ?? view.error} retry=${fault && retry} />`;
  return view.View ? html`<${view.View} rest=${route.rest} />` : html`<p class="empty" aria-busy="true">Loading …</p>`;
}

function Broken({ title, error, retry }) {
  return html`
    <${Notice} tone="bad" icon="alert" actions=${retry && html`<button type="button" class="button" onClick=${retry}>Draw it again</button>`}>
      <p>The view ${title} cannot be shown: ${error.message}</p>
      <p class="quiet">The rest of the page goes on. Reload it if that does not help.</p>
    <//>
  `;
}
