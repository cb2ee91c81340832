/**
 * Draw what lies on the map, one function a layer, from the floor up.
 *
 * A layer draws with `pen` {context, view, size, colours, pixel}: the 2-D context in CSS pixels,
 * how the floor is looked at, and named colours. `world` holds what is known; a layer whose
 * part is missing draws nothing.
 */

import { doubtEllipse, fromBase, gridStep, toMap, toScreen } from "./map_view.js";

const TURN = 2 * Math.PI;
const LEAST_ARROW_PX = 9;
const SCAN_DOT_PX = 1.6;
const OBSTACLE_CELL_M = 0.05; // as the robot keeps them
const MOVER_RADIUS_M = 0.3;
const LABEL_ABOVE_PX_PER_M = 45;
const FONT = "12px system-ui, sans-serif";

/** The layers in drawing order: name, words for its switch, whether shown at first, how to draw. */
export const LAYERS = [
  { name: "occupancy", words: "Map", draw: drawOccupancy },
  { name: "grid", words: "Grid", draw: drawGrid },
  { name: "keep_out", words: "Keep-out", draw: drawKeepOut },
  { name: "surfaces", words: "Surfaces", draw: drawSurfaces },
  { name: "places", words: "Places", draw: drawPlaces },
  { name: "path", words: "Path", draw: drawPath },
  { name: "obstacles", words: "Not on the map", draw: drawObstacles },
  { name: "scan", words: "Lidar", draw: drawScan },
  { name: "zones", words: "Zones", draw: drawZones },
  { name: "robot", words: "Robot", draw: drawRobot },
  { name: "objects", words: "Objects", draw: drawObjects },
];

/** Draw every layer whose name is in `shown`. */
export function drawMap(pen, world, shown) {
  const { context, size, colours } = pen;
  context.fillStyle = colours.unknown;
  context.fillRect(0, 0, size.width, size.height);
  for (const layer of LAYERS) {
    if (!shown.has(layer.name)) continue;
    context.save();
    layer.draw(pen, world);
    context.restore();
  }
  drawScaleBar(pen);
}

function drawOccupancy({ context, view, size }, { grid }) {
  if (!grid) return;
  const [left, bottom] = toScreen(view, size, grid.origin_m);
  const scale = grid.resolution_m * view.px_per_m;
  context.imageSmoothingEnabled = scale < 1;
  const high = grid.image.height * scale;
  context.drawImage(grid.image, left, bottom - high, grid.image.width * scale, high);
}

function drawGrid({ context, view, size, colours }) {
  const step_m = gridStep(view);
  const [x_min, y_max] = toMap(view, size, [0, 0]);
  const [x_max, y_min] = toMap(view, size, [size.width, size.height]);
  context.strokeStyle = colours.grid;
  context.lineWidth = 1;
  context.beginPath();
  for (let x = Math.ceil(x_min / step_m) * step_m; x <= x_max; x += step_m) {
    const at = Math.round(toScreen(view, size, [x, 0])[0]) + 0.5;
    context.moveTo(at, 0);
    context.lineTo(at, size.height);
  }
  for (let y = Math.ceil(y_min / step_m) * step_m; y <= y_max; y += step_m) {
    const at = Math.round(toScreen(view, size, [0, y])[1]) + 0.5;
    context.moveTo(0, at);
    context.lineTo(size.width, at);
  }
  context.stroke();
}

function drawKeepOut(pen, { keep_out = [] }) {
  for (const zone of keep_out) {
    fillOutline(pen, zone.polygon_m, pen.colours.keepOut, 0.14);
    dashOutline(pen, zone.polygon_m, pen.colours.keepOut);
  }
}

function drawSurfaces(pen, { surfaces = [] }) {
  for (const surface of surfaces) fillOutline(pen, surface.polygon_m, pen.colours.surface, 0.25);
}

function drawPlaces(pen, { places = [] }) {
  const { context, view, size, colours } = pen;
  for (const place of places) {
    const [x, y] = toScreen(view, size, [place.x_m, place.y_m]);
    context.fillStyle = colours.place;
    context.beginPath();
    context.arc(x, y, 3, 0, TURN);
    context.fill();
    if (view.px_per_m >= LABEL_ABOVE_PX_PER_M) label(pen, place.name, x, y + 15, colours.place);
  }
}

function drawPath(pen, { path }) {
  if (!path) return;
  line(pen, path.driven ?? [], pen.colours.driven, 2, []);
  line(pen, path.planned ?? [], pen.colours.planned, 2.5, [8, 6]);
  const goal = path.planned?.at(-1);
  if (!goal) return;
  const { context, view, size, colours } = pen;
  const [x, y] = toScreen(view, size, goal);
  context.strokeStyle = colours.planned;
  context.lineWidth = 2.5;
  context.setLineDash([]);
  context.beginPath();
  context.arc(x, y, 6, 0, TURN);
  context.stroke();
}

/** What stands beside the map, in cells; who walks, with the way of the next second. */
function drawObstacles(pen, { obstacles }) {
  if (!obstacles) return;
  const { context, view, size, colours } = pen;
  const side = Math.max(OBSTACLE_CELL_M * view.px_per_m, 2);
  context.fillStyle = colours.obstacle;
  obstacles.x_m.forEach((x_m, index) => {
    const [x, y] = toScreen(view, size, [x_m, obstacles.y_m[index]]);
    context.fillRect(x - side / 2, y - side / 2, side, side);
  });
  obstacles.mover_x_m.forEach((x_m, index) => {
    const at = [x_m, obstacles.mover_y_m[index]];
    const next = [at[0] + obstacles.mover_vx_m_s[index], at[1] + obstacles.mover_vy_m_s[index]];
    circle(pen, at, MOVER_RADIUS_M, colours.obstacle);
    line(pen, [at, next], colours.obstacle, 2, []);
  });
}

function drawScan({ context, view, size, colours }, { pose, scan }) {
  if (!pose || !scan) return;
  context.fillStyle = colours.scan;
  scan.range_m.forEach((range_m, degree) => {
    if (!range_m) return;
    const angle = (degree * Math.PI) / 180;
    const point = fromBase(pose, [range_m * Math.cos(angle), range_m * Math.sin(angle)]);
    const [x, y] = toScreen(view, size, point);
    context.fillRect(x - SCAN_DOT_PX, y - SCAN_DOT_PX, 2 * SCAN_DOT_PX, 2 * SCAN_DOT_PX);
  });
}

function drawZones(pen, { pose, zones = [] }) {
  if (!pose) return;
  for (const zone of zones) {
    const outline = (zone.polygon_m ?? []).map((corner) => fromBase(pose, corner));
    const colour = zone.active ? pen.colours.zoneActive : pen.colours.zone;
    fillOutline(pen, outline, colour, zone.active ? 0.35 : 0.1);
    dashOutline(pen, outline, colour);
  }
}

function drawRobot(pen, { pose, footprint_m = 0.22 }) {
  if (!pose) return;
  const { context, view, size, colours } = pen;
  if (pose.covariance) drawDoubt(pen, pose);
  const [x, y] = toScreen(view, size, [pose.x_m, pose.y_m]);
  const radius = Math.max(footprint_m * view.px_per_m, LEAST_ARROW_PX);
  context.translate(x, y);
  context.rotate(-pose.yaw_rad);
  context.fillStyle = colours.robot;
  context.globalAlpha = pose.state === "lost" ? 0.4 : 0.9;
  context.beginPath();
  context.arc(0, 0, radius, 0, TURN);
  context.fill();
  context.globalAlpha = 1;
  context.fillStyle = colours.robotNose;
  context.beginPath();
  context.moveTo(0.8 * radius, 0);
  context.lineTo(-0.35 * radius, 0.5 * radius);
  context.lineTo(-0.1 * radius, 0);
  context.lineTo(-0.35 * radius, -0.5 * radius);
  context.fill();
}

function drawDoubt({ context, view, size, colours }, pose) {
  const ellipse = doubtEllipse(pose.covariance);
  const [x, y] = toScreen(view, size, [pose.x_m, pose.y_m]);
  const long = Math.max(ellipse.long_m * view.px_per_m, 1);
  const short = Math.max(ellipse.short_m * view.px_per_m, 1);
  context.save();
  context.beginPath();
  context.ellipse(x, y, long, short, -ellipse.yaw_rad, 0, TURN);
  context.fillStyle = colours.doubt;
  context.globalAlpha = 0.25;
  context.fill();
  context.restore();
}

function drawObjects(pen, { objects = [], bystanders = [], selected }) {
  const { context, view, size, colours } = pen;
  for (const one of bystanders) {
    circle(pen, one.position_m, Math.max(one.width_m / 2, 0.1), colours.bystander);
    const [x, y] = toScreen(view, size, one.position_m);
    label(pen, one.class, x, y - 14, colours.bystander);
  }
  for (const one of objects) {
    const chosen = one.id === selected;
    const [x, y] = toScreen(view, size, one.position_m);
    const half_x = Math.max((one.size_m[0] * view.px_per_m) / 2, 4);
    const half_y = Math.max((one.size_m[1] * view.px_per_m) / 2, 4);
    context.save();
    context.translate(x, y);
    context.rotate(-one.yaw_rad);
    context.fillStyle = colours.things[one.colour] ?? colours.thing;
    context.strokeStyle = chosen ? colours.selected : colours.outline;
    context.lineWidth = chosen ? 3 : 1.5;
    context.fillRect(-half_x, -half_y, 2 * half_x, 2 * half_y);
    context.strokeRect(-half_x, -half_y, 2 * half_x, 2 * half_y);
    context.restore();
    const near = view.px_per_m >= LABEL_ABOVE_PX_PER_M;
    if (chosen || near) label(pen, one.name, x, y - half_y - 8, colours.text);
  }
}

function drawScaleBar(pen) {
  const { context, view, size, colours } = pen;
  const step_m = gridStep(view);
  const long = step_m * view.px_per_m;
  const [x, y] = [12, size.height - 12];
  context.strokeStyle = colours.text;
  context.lineWidth = 2;
  context.beginPath();
  context.moveTo(x, y - 5);
  context.lineTo(x, y);
  context.lineTo(x + long, y);
  context.lineTo(x + long, y - 5);
  context.stroke();
  label(pen, `${step_m} m`, x + long / 2, y - 9, colours.text);
}

function circle({ context, view, size }, centre, radius_m, colour) {
  const [x, y] = toScreen(view, size, centre);
  context.strokeStyle = colour;
  context.lineWidth = 2;
  context.beginPath();
  context.arc(x, y, radius_m * view.px_per_m, 0, TURN);
  context.stroke();
}

function trace({ context, view, size }, points) {
  context.beginPath();
  points.forEach((point, index) => {
    const [x, y] = toScreen(view, size, point);
    if (index === 0) context.moveTo(x, y);
    else context.lineTo(x, y);
  });
}

function line(pen, points, colour, width, dash) {
  if (points.length < 2) return;
  trace(pen, points);
  Object.assign(pen.context, { strokeStyle: colour, lineWidth: width, lineJoin: "round" });
  pen.context.setLineDash(dash);
  pen.context.stroke();
}

function fillOutline(pen, points, colour, opacity) {
  if (points.length < 3) return;
  trace(pen, points);
  pen.context.save();
  pen.context.globalAlpha = opacity;
  pen.context.fillStyle = colour;
  pen.context.fill();
  pen.context.restore();
}

function dashOutline(pen, points, colour) {
  if (points.length < 3) return;
  line(pen, [...points, points[0]], colour, 1.25, [4, 3]);
  pen.context.setLineDash([]);
}

function label({ context, colours }, text, x, y, colour) {
  context.font = FONT;
  context.textAlign = "center";
  context.lineWidth = 3;
  context.lineJoin = "round";
  context.strokeStyle = colours.halo;
  context.strokeText(text, x, y);
  context.fillStyle = colour;
  context.fillText(text, x, y);
}
