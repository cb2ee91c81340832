/** Draw the camera's picture and what was seen in it; a detection is {name, box, confidence}. */

const FONT = "600 12px system-ui, sans-serif";
const TAG_HEIGHT_PX = 18;

/** Return the scale and corner at which a picture of so many pixels fits into a size. */
export function placed(picture, size) {
  const scale = Math.min(size.width / picture.width, size.height / picture.height);
  return {
    scale,
    left: (size.width - picture.width * scale) / 2,
    top: (size.height - picture.height * scale) / 2,
  };
}

/** Draw the picture, and over it each detection's box [left, top, right, bottom] in its pixels. */
export function drawCamera(context, size, picture, detections, colours) {
  const at = placed(picture, size);
  context.imageSmoothingQuality = "high";
  context.drawImage(picture, at.left, at.top, picture.width * at.scale, picture.height * at.scale);
  context.font = FONT;
  context.textBaseline = "middle";
  for (const one of detections) drawDetection(context, at, size, one, colours);
}

function drawDetection(context, { scale, left, top }, size, { name, box, confidence }, colours) {
  const [x0, y0, x1, y1] = box;
  const x = left + x0 * scale;
  const y = top + y0 * scale;
  context.lineWidth = 4;
  context.strokeStyle = colours.halo;
  context.strokeRect(x, y, (x1 - x0) * scale, (y1 - y0) * scale);
  context.lineWidth = 2;
  context.strokeStyle = colours.detection;
  context.strokeRect(x, y, (x1 - x0) * scale, (y1 - y0) * scale);
  const words = tag(name, confidence);
  const wide = context.measureText(words).width + 10;
  const tag_x = Math.min(Math.max(x - 1, 0), size.width - wide);
  const tag_y = y >= TAG_HEIGHT_PX ? y - TAG_HEIGHT_PX : y;
  context.fillStyle = colours.detection;
  context.fillRect(tag_x, tag_y, wide, TAG_HEIGHT_PX);
  context.fillStyle = colours.onDetection;
  context.fillText(words, tag_x + 5, tag_y + TAG_HEIGHT_PX / 2 + 0.5);
}

function tag(name, confidence) {
  return Number.isFinite(confidence) ? `${name} ${Math.round(100 * confidence)} %` : name;
}

/** Return the detections as one sentence, for those who cannot see the picture. */
export function told(detections) {
  if (detections.length === 0) return "The camera sees no known thing.";
  const names = detections.map(({ name, confidence }) => tag(name, confidence));
  return `The camera sees ${names.join(", ")}.`;
}
