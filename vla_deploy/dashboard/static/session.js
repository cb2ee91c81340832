/** Know who uses the page, and what they may do. */

import { get, post, useCsrf, whenLoginNeeded } from "./api.js";
import { Store, useStore } from "./store.js";

const RANKS = ["anyone", "viewer", "operator", "admin"];

/** The session as the robot tells it; `null` until it has answered. */
export const session = new Store(null);

/** Ask the robot who we are. */
export async function refresh() {
  adopt(await get("session"));
}

/** Log in. */
export async function login(user, password) {
  await post("login", { user, password });
  await refresh();
}

/** Log in by the link that the page was opened with, where it is one; its code counts once. */
export async function followLink() {
  const code = location.hash.match(/^#\/login\/([\w-]+)$/)?.[1];
  if (!code) return;
  history.replaceState(null, "", "#/now");
  await post("login/code", { code });
}

/** Log out; what needs a role asks for it again. */
export async function logout() {
  await post("logout");
  await refresh();
}

/** Tell whether the user has at least a role. */
export function may(role) {
  return RANKS.indexOf(session.value?.role ?? "anyone") >= RANKS.indexOf(role);
}

/** Return the session, and draw again when it changes. */
export function useSession() {
  return useStore(session);
}

function adopt(told) {
  useCsrf(told.csrf);
  session.set(told);
}

whenLoginNeeded(() => {
  if (session.value) session.set({ ...session.value, role: "anyone", login_needed: true });
});
