/** Turn pointers, wheel and keys on the map into changes of its view. */

import { panned, zoomed } from "./map_view.js";

const CLICK_PX = 5;
const PAN_PX = 40;
const ZOOM = 1.25;

const KEYS = {
  ArrowLeft: (view) => panned(view, PAN_PX, 0),
  ArrowRight: (view) => panned(view, -PAN_PX, 0),
  ArrowUp: (view) => panned(view, 0, PAN_PX),
  ArrowDown: (view) => panned(view, 0, -PAN_PX),
  "+": (view, size) => zoomed(view, size, ZOOM),
  "=": (view, size) => zoomed(view, size, ZOOM),
  "-": (view, size) => zoomed(view, size, 1 / ZOOM),
};

/**
 * Listen to a canvas; return what ends that.
 *
 * `look` {view, size} is read, `change(view)` called with what it becomes, `pick(pixel)` for a
 * click, `fit()` for the key 0.
 */
export function listen(canvas, { look, change, pick, fit }) {
  const held = new Map();
  let moved_px = 0;
  const at = (event) => [event.offsetX, event.offsetY];
  const on = {
    pointerdown: (event) => {
      canvas.setPointerCapture(event.pointerId);
      held.set(event.pointerId, at(event));
      if (held.size === 1) moved_px = 0;
    },
    pointermove: (event) => {
      const before = held.get(event.pointerId);
      if (!before) return;
      const now = at(event);
      const { view, size } = look();
      moved_px += Math.hypot(now[0] - before[0], now[1] - before[1]);
      const other = [...held].find(([id]) => id !== event.pointerId)?.[1];
      held.set(event.pointerId, now);
      if (other) change(pinched(view, size, before, now, other));
      else if (moved_px > CLICK_PX) change(panned(view, now[0] - before[0], now[1] - before[1]));
    },
    pointerup: (event) => {
      if (held.size === 1 && moved_px <= CLICK_PX) pick(at(event));
      held.delete(event.pointerId);
    },
    pointercancel: (event) => held.delete(event.pointerId),
    wheel: (event) => {
      if (!event.ctrlKey && document.activeElement !== canvas) return; // the page scrolls
      event.preventDefault();
      const { view, size } = look();
      change(zoomed(view, size, Math.exp(-event.deltaY / 400), at(event)));
    },
    keydown: (event) => {
      const { view, size } = look();
      if (event.ctrlKey || event.metaKey || event.altKey) return;
      if (event.key === "0") fit();
      else if (KEYS[event.key]) change(KEYS[event.key](view, size));
      else return;
      event.preventDefault();
    },
  };
  for (const [name, act] of Object.entries(on)) canvas.addEventListener(name, act, { passive: false });
  return () => {
    for (const [name, act] of Object.entries(on)) canvas.removeEventListener(name, act);
  };
}

function pinched(view, size, before, now, other) {
  const apart = (point) => Math.max(Math.hypot(point[0] - other[0], point[1] - other[1]), 1);
  const middle = [(now[0] + other[0]) / 2, (now[1] + other[1]) / 2];
  const drawn = panned(view, (now[0] - before[0]) / 2, (now[1] - before[1]) / 2);
  return zoomed(drawn, size, apart(now) / apart(before), middle);
}
