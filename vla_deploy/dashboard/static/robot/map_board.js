/** Hold the map's canvas: what is shown of the floor, and how it is looked at. */

import { Easel } from "../easel.js";
import { isStale, latest, subscribe } from "../live.js";
import { THING_COLOURS } from "./map_colours.js";
import { listen } from "./map_input.js";
import { drawMap } from "./map_layers.js";
import { centred, fitted, toMap, zoomed } from "./map_view.js";
import { boundsOf, thingAt, worldOf } from "./map_world.js";

const TOPICS = ["pose", "scan", "scene", "path", "control_status", "live_obstacles"];
const MOST_HZ = 15;
const PICK_PX = 14;
const NEAR_PX_PER_M = 90;

/** Return what is known of the world; `what` {model, floor, grid, selected} does not change live. */
export function worldNow({ model, floor, grid, selected }) {
  const samples = Object.fromEntries(TOPICS.map((topic) => [topic, latest(topic)]));
  return worldOf({ samples, isStale, model, grid, plan: floor, selected });
}

export class MapBoard {
  #what;
  #view = null;
  #size = { width: 1, height: 1 };
  #easel;
  #ends;

  /** `what` is {model, floor, grid, selected, shown, colours, follows}. */
  constructor(canvas, what, { onPick, onMoved }) {
    this.#what = what;
    this.#easel = new Easel(canvas, (context, size) => this.#draw(context, size), MOST_HZ);
    const change = (view) => {
      this.#look(view);
      onMoved();
    };
    this.#ends = [
      ...TOPICS.map((topic) => subscribe(topic, () => this.#easel.request())),
      listen(canvas, {
        look: () => ({ view: this.#seen, size: this.#size }),
        change,
        fit: () => this.fit(),
        pick: (pixel) => onPick(this.#under(pixel)),
      }),
    ];
  }

  /** Take what has changed; another floor is seen whole at first. */
  show(what) {
    if (what.floor !== this.#what.floor) this.#view = null;
    this.#what = what;
    this.#easel.request();
  }

  /** Look at all of it. */
  fit() {
    this.#look(fitted(boundsOf(worldNow(this.#what)), this.#size));
  }

  /** Look from nearer (a factor above 1) or farther. */
  zoom(factor) {
    this.#look(zoomed(this.#seen, this.#size, factor));
  }

  /** Bring a point in metres into the middle, near enough to see what is there. */
  goTo(point) {
    const px_per_m = Math.max(this.#seen.px_per_m, NEAR_PX_PER_M);
    this.#look(centred({ ...this.#seen, px_per_m }, point));
  }

  /** Stop for good. */
  destroy() {
    for (const end of this.#ends) end();
    this.#easel.destroy();
  }

  get #seen() {
    return this.#view ?? fitted(boundsOf(worldNow(this.#what)), this.#size);
  }

  #look(view) {
    this.#view = view;
    this.#easel.request();
  }

  #under(pixel) {
    const reach_m = PICK_PX / this.#seen.px_per_m;
    return thingAt(worldNow(this.#what), toMap(this.#seen, this.#size, pixel), reach_m);
  }

  #draw(context, size) {
    const world = worldNow(this.#what);
    this.#size = size;
    if (!this.#view && (world.grid || world.pose)) this.#view = fitted(boundsOf(world), size);
    if (!this.#view) return;
    const { follows, shown, colours } = this.#what;
    if (follows && world.pose) this.#view = centred(this.#view, [world.pose.x_m, world.pose.y_m]);
    const pen = { context, size, view: this.#view, colours: { ...colours, things: THING_COLOURS } };
    drawMap(pen, world, shown);
  }
}
