/** See the robot: what its camera sees, where it is, how its joints stand. */

import { CameraCard } from "../robot/camera_card.js";
import { detectionsOf } from "../robot/detections.js";
import { useFloor, useModel } from "../robot/floor.js";
import { JointCard } from "../robot/joint_card.js";
import { JointTable } from "../robot/joint_table.js";
import { jointsByName } from "../robot/joint_values.js";
import { MapCard } from "../robot/map_card.js";
import { Failure } from "../parts.js";
import { html, useCallback, useMemo, useState } from "../ui.js";

export function View() {
  const floor = useFloor();
  const model = useModel();
  const [chosen, choose] = useState(null);
  const joints = useMemo(() => jointsByName(model.data), [model.data]);
  const detect = useCallback((header) => detectionsOf(header), []);
  return html`
    <div class="view-head"><h1>Robot</h1></div>
    ${[floor, model].map(({ error }) => error && html`<${Failure} error=${error} />`)}
    <div class="robot-view">
      <${MapCard} floor=${floor.data} model=${model.data} />
      <div class="robot-side">
        <${CameraCard} detect=${detect} />
        <${JointCard} model=${model.data} chosen=${chosen} />
      </div>
      <${JointTable} joints=${joints} chosen=${chosen} onChoose=${choose} />
    </div>
  `;
}
