/** Give drawings on a canvas the colours of the theme in force. */

import { useStore } from "./store.js";
import { theme } from "./theme.js";
import { useEffect, useMemo, useState } from "./ui.js";

const DARK = matchMedia("(prefers-color-scheme: dark)");
const CONTRAST = matchMedia("(prefers-contrast: more)");

/** Return the value of each custom property of `names` {key: "--property"}, as colours. */
export function resolved(names) {
  const probe = document.createElement("span");
  probe.hidden = true;
  document.body.append(probe);
  const found = {};
  for (const [key, property] of Object.entries(names)) {
    probe.style.color = `var(${property})`;
    found[key] = getComputedStyle(probe).color;
  }
  probe.remove();
  return found;
}

/** Return the colours, read again when the theme changes; `names` must be a constant. */
export function useColours(names) {
  const choice = useStore(theme);
  const [change, changed] = useState(0);
  useEffect(() => {
    const again = () => changed((count) => count + 1);
    for (const query of [DARK, CONTRAST]) query.addEventListener("change", again);
    return () => {
      for (const query of [DARK, CONTRAST]) query.removeEventListener("change", again);
    };
  }, []);
  return useMemo(() => resolved(names), [names, choice, change]);
}
