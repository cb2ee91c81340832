/** Read the detections that come with a picture. */

import { nameOf } from "./map_world.js";

/** Return the detections of a picture's header as {name, box, confidence}. */
export function detectionsOf(header) {
  return (header.detections ?? []).map((one) => ({
    name: one.name ?? nameOf(one),
    box: one.box,
    confidence: one.confidence ?? null,
  }));
}
