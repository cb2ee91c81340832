/** Hand out what was recorded: flights, saved at every stop, and recordings, begun by a person. */

import { address, post } from "../api.js";
import { useAct, useAnswer } from "../asking.js";
import { useTopic } from "../following.js";
import { bytes, clock, duration, words } from "../format.js";
import { Icon } from "../icons.js";
import { Badge, Button, Card, Empty, Failure } from "../parts.js";
import { html } from "../ui.js";

const LOOK_MS = 4_000;

export function FilesPanel() {
  return html`
    <div class="grid files">
      <${Flights} />
      <${Recordings} />
    </div>
  `;
}

function Flights() {
  const { data, error } = useAnswer("flights", LOOK_MS);
  return html`
    <${Card} title="Flights" note="the half minute before every stop and crash">
      ${error && html`<${Failure} error=${error} />`}
      <${Files} files=${data} folder="flights" none="None yet: one is saved at every stop and crash." />
    <//>
  `;
}

function Recordings() {
  const { data, error, again } = useAnswer("recordings", LOOK_MS);
  const status = useTopic("recording_status");
  const isOn = Boolean(status.data) && status.data.state !== "off";
  const [toggle, isBusy] = useAct(async () => {
    await post(isOn ? "recordings/stop" : "recordings");
    await again();
  });
  const actions = html`
    <${Button}
      needs="operator"
      kind=${isOn ? "danger" : "usual"}
      icon=${isOn ? "pause" : "record"}
      busy=${isBusy}
      disabled=${status.stale}
      title=${status.stale ? "The recorder is silent" : ""}
      onClick=${toggle}
    >
      ${isOn ? "Stop recording" : "Record"}
    <//>
  `;
  return html`
    <${Card} title="Recordings" stale=${status.stale} age_s=${status.age_s} actions=${actions}>
      ${isOn && html`<${Recording} status=${status.data} />`}
      ${status.data?.refused && html`<p class="quiet">Refused: ${status.data.refused}</p>`}
      ${error && html`<${Failure} error=${error} />`}
      <${Files} files=${data} folder="recordings" none="None yet: press Record, do something, stop." />
    <//>
  `;
}

/** Say what is being recorded, and what of it is lost. */
function Recording({ status }) {
  const facts = [
    status.file,
    bytes(status.file_bytes),
    `${status.messages} messages`,
    status.lost > 0 && `${status.lost} lost`,
    status.left_s !== null && `${duration(status.left_s)} left`,
  ];
  return html`
    <p class="row">
      <${Badge} tone=${status.lost > 0 ? "warn" : "info"} icon="record">${words(status.state)}<//>
      <span class="quiet small">${facts.filter(Boolean).join(" · ")}${status.why && `: ${status.why}`}</span>
    </p>
  `;
}

function Files({ files, folder, none }) {
  if (!files) return null;
  if (!files.length) return html`<${Empty} icon="record">${none}<//>`;
  return html`
    <ul class="file-list">
      ${files.map(
        ({ name, bytes: size, saved_s }) => html`
          <li key=${name}>
            <span class="grow"><span class="mono">${name}</span><span class="quiet small file-note">${bytes(size)} · ${clock(saved_s)}</span></span>
            <a class="button" href=${address(`${folder}/${encodeURIComponent(name)}`)} download=${name} aria-label="Download ${name}">
              <${Icon} name="download" /><span>Download</span>
            </a>
          </li>
        `,
      )}
    </ul>
  `;
}
