/** Show what happened: alarms, logs, files, and who did what. */

import { AlarmsPanel } from "../events/alarms_panel.js";
import { AuditPanel } from "../events/audit_panel.js";
import { FilesPanel } from "../events/files_panel.js";
import { LogsPanel } from "../events/logs_panel.js";
import { may, useSession } from "../session.js";
import { html } from "../ui.js";

const PANELS = [
  { name: "alarms", title: "Alarms", Panel: AlarmsPanel, needs: "viewer" },
  { name: "logs", title: "Logs", Panel: LogsPanel, needs: "viewer" },
  { name: "files", title: "Recordings", Panel: FilesPanel, needs: "viewer" },
  { name: "audit", title: "Audit", Panel: AuditPanel, needs: "admin" },
];

export function View({ rest }) {
  useSession();
  const offered = PANELS.filter(({ needs }) => may(needs));
  const { name: here, Panel } = offered.find(({ name }) => name === rest[0]) ?? offered[0];
  return html`
    <div class="view-head">
      <h1>Events</h1>
      <nav class="choice" aria-label="Events">
        ${offered.map(
          ({ name, title }) => html`<a key=${name} href="#/events/${name}" aria-current=${name === here ? "page" : null}>${title}</a>`,
        )}
      </nav>
    </div>
    <${Panel} key=${here} />
  `;
}
