/**
 * Look onto the floor: metres of the map frame (x right, y up) to pixels of a canvas (y down).
 *
 * A view is {x_m, y_m, px_per_m}: the point in the middle of the canvas, and the scale. A size is
 * {width, height} in CSS pixels. Every function here is pure.
 */

const LEAST_PX_PER_M = 8;
const MOST_PX_PER_M = 800;
const GRID_STEPS_M = [0.1, 0.25, 0.5, 1, 2, 5, 10];
const LEAST_GRID_PX = 36;

/** Return the view that shows all of `bounds` {x_min, x_max, y_min, y_max} in metres. */
export function fitted(bounds, size, margin_px = 16) {
  const wide_m = Math.max(bounds.x_max - bounds.x_min, 0.5);
  const high_m = Math.max(bounds.y_max - bounds.y_min, 0.5);
  const across = Math.max(size.width - 2 * margin_px, 1) / wide_m;
  const along = Math.max(size.height - 2 * margin_px, 1) / high_m;
  return {
    x_m: (bounds.x_min + bounds.x_max) / 2,
    y_m: (bounds.y_min + bounds.y_max) / 2,
    px_per_m: clamped(Math.min(across, along)),
  };
}

/** Return where a point [x, y] in metres lies on the canvas, in pixels. */
export function toScreen(view, size, [x_m, y_m]) {
  return [
    size.width / 2 + (x_m - view.x_m) * view.px_per_m,
    size.height / 2 - (y_m - view.y_m) * view.px_per_m,
  ];
}

/** Return the point in metres under a pixel of the canvas. */
export function toMap(view, size, [x_px, y_px]) {
  return [
    view.x_m + (x_px - size.width / 2) / view.px_per_m,
    view.y_m - (y_px - size.height / 2) / view.px_per_m,
  ];
}

/** Return the view after a drag by so many pixels: what was under the pointer stays there. */
export function panned(view, right_px, down_px) {
  return {
    ...view,
    x_m: view.x_m - right_px / view.px_per_m,
    y_m: view.y_m + down_px / view.px_per_m,
  };
}

/** Return the view scaled by `factor`; the point under `pixel` stays where it is. */
export function zoomed(view, size, factor, pixel = [size.width / 2, size.height / 2]) {
  const px_per_m = clamped(view.px_per_m * factor);
  const [x_m, y_m] = toMap(view, size, pixel);
  const moved = { ...view, px_per_m };
  const [now_x_m, now_y_m] = toMap(moved, size, pixel);
  return { ...moved, x_m: view.x_m + x_m - now_x_m, y_m: view.y_m + y_m - now_y_m };
}

/** Return the view moved so that a point in metres is in its middle. */
export function centred(view, [x_m, y_m]) {
  return { ...view, x_m, y_m };
}

/** Return the distance between grid lines that can be told apart at this scale. */
export function gridStep(view) {
  const wide_enough = GRID_STEPS_M.find((step_m) => step_m * view.px_per_m >= LEAST_GRID_PX);
  return wide_enough ?? GRID_STEPS_M.at(-1);
}

/** Return a point of the base frame (x forward, y left) in the map frame. */
export function fromBase(pose, [forward_m, left_m]) {
  const cos = Math.cos(pose.yaw_rad);
  const sin = Math.sin(pose.yaw_rad);
  return [
    pose.x_m + cos * forward_m - sin * left_m,
    pose.y_m + sin * forward_m + cos * left_m,
  ];
}

/** Return half axes in metres and direction of the ellipse that holds a pose with 95 %. */
export function doubtEllipse(covariance) {
  const [[xx, xy], [, yy]] = covariance;
  const middle = (xx + yy) / 2;
  const spread = Math.hypot((xx - yy) / 2, xy);
  const scale = 5.991; // chi-square of two dimensions at 95 %
  return {
    long_m: Math.sqrt(scale * Math.max(middle + spread, 0)),
    short_m: Math.sqrt(scale * Math.max(middle - spread, 0)),
    yaw_rad: Math.atan2(2 * xy, xx - yy) / 2,
  };
}

function clamped(px_per_m) {
  return Math.min(Math.max(px_per_m, LEAST_PX_PER_M), MOST_PX_PER_M);
}
