/** Order what another profile would change, for people. Pure. */

import { sentence } from "../format.js";

const NOTHING = "not set";

/** Return `[{part, rows: [{key, old, wanted, kind}]}]`, by the first word of the keys. */
export function partsOf(keys) {
  const parts = new Map();
  for (const [key, { current, wanted }] of Object.entries(keys)) {
    const [part, ...rest] = key.split(".");
    const name = rest.length ? part : "general";
    if (!parts.has(name)) parts.set(name, []);
    parts.get(name).push({
      key: rest.join(".") || part,
      old: written(current),
      wanted: written(wanted),
      kind: kindOf(current, wanted),
    });
  }
  return [...parts].map(([part, rows]) => ({ part: sentence(part), rows }));
}

/** Return a value of a profile as text. */
export function written(value) {
  if (value === null || value === undefined) return NOTHING;
  if (value === "") return "none";
  if (Array.isArray(value)) return value.map(written).join(", ") || "none";
  if (typeof value === "object") return Object.entries(value).map(([key, one]) => `${key} ${written(one)}`).join(", ");
  return String(value);
}

function kindOf(old, wanted) {
  if (typeof old !== "number" || typeof wanted !== "number") return "changed";
  return wanted > old ? "more" : "less";
}
