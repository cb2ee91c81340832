/** Put together what the map shows, from the newest samples of the live topics. Pure. */

import { words } from "../format.js";

const PLACE_STATES = ["tracking", "unsure", "lost"];
const ZONE_CAUSE = /^obstacle_/;

/** Return what is known, for `drawMap`; what is stale is left out, a pose is kept and marked. */
export function worldOf({ samples, isStale, model, grid, plan, selected }) {
  const fresh = (topic) => (samples[topic] && !isStale(samples[topic]) ? samples[topic].data : null);
  const scene = fresh("scene");
  const pose = poseOf(samples.pose?.data);
  const old = isStale(samples.pose);
  return {
    grid,
    places: plan?.places ?? [],
    keep_out: plan?.keep_out ?? [],
    pose: pose && { ...pose, state: old ? "lost" : pose.state },
    scan: old ? null : fresh("scan"),
    path: fresh("path"),
    obstacles: fresh("live_obstacles"),
    zones: zonesOf(model, fresh("control_status")),
    footprint_m: model?.footprint_m,
    surfaces: scene?.surfaces ?? [],
    bystanders: scene?.bystanders ?? [],
    objects: (scene?.objects ?? []).map((one) => ({ ...one, name: nameOf(one) })),
    selected,
  };
}

/** Return a pose with its state as a word and its covariance by rows. */
export function poseOf(data) {
  if (!data) return null;
  const { covariance, state } = data;
  return {
    ...data,
    covariance: covariance?.length === 9 ? [0, 3, 6].map((at) => covariance.slice(at, at + 3)) : covariance,
    state: typeof state === "number" ? PLACE_STATES[state] : state,
  };
}

/** Return the safety zones, each with whether control acts on it. */
export function zonesOf(model, control) {
  const acting = ZONE_CAUSE.test(control?.cause ?? "") ? control.subject : null;
  return (model?.zones ?? []).map((zone) => ({ ...zone, active: zone.name === acting }));
}

/** Return what to call a thing: "red cup". */
export function nameOf(thing) {
  return words([thing.colour, thing.class].filter(Boolean).join(" "));
}

/** Return the thing or bystander nearest to a point in metres, within `reach_m`, or null. */
export function thingAt(world, [x_m, y_m], reach_m) {
  let best = null;
  for (const one of world.objects) {
    const away_m = Math.hypot(one.position_m[0] - x_m, one.position_m[1] - y_m);
    const near = away_m <= Math.max(reach_m, one.size_m[0] / 2, one.size_m[1] / 2);
    if (near && (!best || away_m < best.away_m)) best = { one, away_m };
  }
  return best?.one ?? null;
}

/** Return the bounds of a map in metres, or of what lies around the robot without one. */
export function boundsOf(world) {
  if (world.grid) {
    const { origin_m, resolution_m, image } = world.grid;
    return {
      x_min: origin_m[0],
      y_min: origin_m[1],
      x_max: origin_m[0] + image.width * resolution_m,
      y_max: origin_m[1] + image.height * resolution_m,
    };
  }
  const { x_m, y_m } = world.pose ?? { x_m: 0, y_m: 0 };
  return { x_min: x_m - 3, x_max: x_m + 3, y_min: y_m - 3, y_max: y_m + 3 };
}

/** Say in one sentence what the map shows, for those who cannot see it. */
export function summaryOf(world) {
  const { pose, zones, objects, path } = world;
  const where = pose
    ? `The robot is at x ${pose.x_m.toFixed(2)} m, y ${pose.y_m.toFixed(2)} m, heading ${degrees(pose.yaw_rad)}, ${pose.state}.`
    : "The robot's place is not known.";
  const acting = zones.filter((zone) => zone.active).map((zone) => zone.name);
  const around = acting.length ? `Zone ${acting.join(", ")} is not clear.` : "No safety zone acts.";
  const way = path?.planned?.length ? " It follows a planned path." : "";
  return `${where} ${around} ${objects.length} things are known.${way}`;
}

function degrees(radians) {
  return `${Math.round((radians * 180) / Math.PI)}°`;
}
