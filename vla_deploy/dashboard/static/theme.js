/** Dark, light, or as the device has it. */

import { Store } from "./store.js";

const KEY = "vla-theme";
const CHOICES = ["auto", "light", "dark"];

/** The choice in force. */
export const theme = new Store(stored());

/** Take the next choice, and keep it on this device. */
export function nextTheme() {
  const next = CHOICES[(CHOICES.indexOf(theme.value) + 1) % CHOICES.length];
  localStorage.setItem(KEY, next);
  apply(next);
}

/** Return a colour of the tokens as a canvas takes it, e.g. `colour("--series-1")`. */
export function colour(token) {
  const probe = document.createElement("i");
  probe.style.color = `var(${token})`;
  document.body.append(probe);
  const resolved = getComputedStyle(probe).color;
  probe.remove();
  return resolved;
}

function stored() {
  const kept = localStorage.getItem(KEY);
  return CHOICES.includes(kept) ? kept : "auto";
}

function apply(choice) {
  if (choice === "auto") delete document.documentElement.dataset.theme;
  else document.documentElement.dataset.theme = choice;
  theme.set(choice);
}

apply(theme.value);
