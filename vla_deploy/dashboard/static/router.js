/** Show one view at a time, by the hash of the address. */

import { Store, useStore } from "./store.js";
import { useEffect } from "./ui.js";

/** Every view, in the order of the navigation; a view's module exports `View`. */
export const ROUTES = [
  { name: "now", title: "Now", icon: "pulse", load: () => import("./views/now.js") },
  { name: "robot", title: "Robot", icon: "robot", load: () => import("./views/robot.js") },
  { name: "command", title: "Command", icon: "speech", load: () => import("./views/command.js") },
  { name: "budgets", title: "Budgets", icon: "gauge", load: () => import("./views/budgets.js") },
  { name: "events", title: "Events", icon: "bell", load: () => import("./views/events.js") },
  { name: "profile", title: "Profile", icon: "sliders", load: () => import("./views/profile.js") },
];

const route = new Store(read());

/** Return the route shown: `{name, title, icon, load, rest}`; `rest` is what follows the name. */
export function useRoute() {
  const shown = useStore(route);
  useEffect(() => {
    const changed = () => route.set(read());
    addEventListener("hashchange", changed);
    return () => removeEventListener("hashchange", changed);
  }, []);
  return shown;
}

/** Go to a view, e.g. `go("events/logs")`. */
export function go(path) {
  location.hash = `#/${path}`;
}

function read() {
  const [name, ...rest] = location.hash.replace(/^#\/?/, "").split("/");
  const known = ROUTES.find((one) => one.name === name) ?? ROUTES[0];
  return { ...known, rest: rest.map(decodeURIComponent) };
}
