/** The map: where the robot is and how sure of it, what is around, what it keeps away from. */

import { useColours } from "../colours.js";
import { Button, Card } from "../parts.js";
import { useSampled } from "../sampled.js";
import { html, useEffect, useMemo, useRef, useState } from "../ui.js";
import { MapBoard, worldNow } from "./map_board.js";
import { MAP_COLOURS } from "./map_colours.js";
import { coloured } from "./map_image.js";
import { LAYERS } from "./map_layers.js";
import { MapList } from "./map_list.js";
import { summaryOf } from "./map_world.js";

const ZOOM = 1.4;

/** Show the map; `floor` (picture, its place, places, keep-out zones) and `model` may be null. */
export function MapCard({ floor, model }) {
  const [shown, setShown] = useState(() => new Set(LAYERS.map((layer) => layer.name)));
  const [selected, select] = useState(null);
  const [follows, follow] = useState(false);
  const pose = useSampled("pose", 500);
  const what = useWhat({ floor, model, shown, selected, follows });
  const [canvas, board] = useBoard(what, {
    onPick: (thing) => select(thing?.id ?? null),
    onMoved: () => follow(false),
  });
  const choose = (thing) => {
    select(thing?.id ?? null);
    if (!thing) return;
    follow(false);
    board.current.goTo(thing.position_m);
  };
  const world = worldNow(what);
  const acts = html`<${MapActs} board=${board} follows=${follows} follow=${follow} />`;
  return html`
    <${Card} title="Map" stale=${pose.stale} age_s=${pose.age_s} actions=${acts}>
      <canvas
        ref=${canvas}
        class="map"
        tabindex="0"
        role="application"
        aria-label="Map of the floor"
        aria-describedby="map-told map-keys"
      ></canvas>
      <p id="map-keys" class="out-of-sight">Arrow keys move, plus and minus zoom, 0 shows all.</p>
      <${Switches} shown=${shown} toggle=${(name) => setShown((before) => toggled(before, name))} />
      <${MapList} world=${world} summary=${summaryOf(world)} selected=${selected} select=${choose} />
    <//>
  `;
}

function MapActs({ board, follows, follow }) {
  const zoom = (factor) => () => board.current.zoom(factor);
  const fit = () => {
    follow(false);
    board.current.fit();
  };
  return html`
    <div class="row tight">
      <${Button} kind="plain" aria-label="Zoom in" onClick=${zoom(ZOOM)}>+<//>
      <${Button} kind="plain" aria-label="Zoom out" onClick=${zoom(1 / ZOOM)}>−<//>
      <${Button} kind="plain" onClick=${fit}>Fit<//>
      <${Button} kind="plain" aria-pressed=${follows ? "true" : "false"} onClick=${() => follow(!follows)}>Follow<//>
    </div>
  `;
}

function Switches({ shown, toggle }) {
  return html`
    <div class="layers" role="group" aria-label="Layers of the map">
      ${LAYERS.map(
        ({ name, words }) => html`
          <button key=${name} type="button" class="chip" data-layer=${name} aria-pressed=${shown.has(name) ? "true" : "false"} onClick=${() => toggle(name)}>
            <span class="swatch" aria-hidden="true"></span>${words}
          </button>
        `,
      )}
    </div>
  `;
}

/** Gather what the board draws from; the map's picture is coloured once per theme. */
function useWhat({ floor, model, shown, selected, follows }) {
  const colours = useColours(MAP_COLOURS);
  const grid = useMemo(() => {
    if (!floor?.picture) return null;
    const { origin_m, resolution_m } = floor;
    return { image: coloured(floor.picture, colours), origin_m, resolution_m };
  }, [floor, colours]);
  return useMemo(
    () => ({ floor, model, grid, shown, selected, follows, colours }),
    [floor, model, grid, shown, selected, follows, colours],
  );
}

function useBoard(what, on) {
  const canvas = useRef(null);
  const board = useRef(null);
  const newest = useRef(on);
  newest.current = on;
  useEffect(() => {
    board.current = new MapBoard(canvas.current, what, {
      onPick: (thing) => newest.current.onPick(thing),
      onMoved: () => newest.current.onMoved(),
    });
    return () => board.current.destroy();
  }, []);
  useEffect(() => board.current.show(what), [what]);
  return [canvas, board];
}

function toggled(set, name) {
  const next = new Set(set);
  if (!next.delete(name)) next.add(name);
  return next;
}
