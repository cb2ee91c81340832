/** Read binary messages: one byte kind, header length (uint32, little-endian), JSON, payload. */

/** Topic of each kind of frame. */
export const FRAME_KINDS = { 1: "camera" };

const HEADER_AT = 5;

/** Return the frame as a message whose data is `{header..., payload: Uint8Array}`, or null. */
export function readFrame(buffer) {
  const view = new DataView(buffer);
  const topic = FRAME_KINDS[view.getUint8(0)];
  if (!topic) return null; // a kind that a newer server sends
  const length = view.getUint32(1, true);
  const text = new TextDecoder().decode(new Uint8Array(buffer, HEADER_AT, length));
  const header = JSON.parse(text);
  const payload = new Uint8Array(buffer, HEADER_AT + length);
  return { topic, stamp_s: header.stamp_s, age_s: header.age_s, data: { ...header, payload } };
}
