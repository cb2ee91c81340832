/** Ask the robot's HTTP API; every failure is an ApiError that says what to try. */

const ROOT = new URL("api/v1/", document.baseURI);
const TIMEOUT_MS = 10_000;
const SILENT = {
  code: "no_answer",
  what: "The robot's dashboard does not answer.",
  try: "Check the network. The stop button has a way of its own.",
};

let csrf = "";
let onLoginNeeded = () => {};

/** Say what was refused, and what helps. */
export class ApiError extends Error {
  constructor(status, { code, what, try: advice }) {
    super(what);
    this.status = status;
    this.code = code;
    this.what = what;
    this.advice = advice ?? "";
  }
}

/** Set the token that every act carries, so that no other page can act in this one's name. */
export function useCsrf(token) {
  csrf = token ?? "";
}

/** Call `listener` when the API no longer knows who asks. */
export function whenLoginNeeded(listener) {
  onLoginNeeded = listener;
}

/** Return the address of something below the API. */
export function address(path) {
  return new URL(path, ROOT).href;
}

/** Return the answer to a GET. */
export function get(path) {
  return ask("GET", path);
}

/** Return the answer to a POST with a JSON body. */
export function post(path, body = {}) {
  return ask("POST", path, body);
}

async function ask(method, path, body) {
  const response = await reach(method, path, body);
  const told = await readJson(response);
  if (response.ok) return told;
  if (response.status === 401) onLoginNeeded();
  throw new ApiError(response.status, told?.error ?? unnamed(response));
}

async function reach(method, path, body) {
  const headers = { Accept: "application/json" };
  if (method !== "GET") {
    headers["Content-Type"] = "application/json";
    headers["X-CSRF-Token"] = csrf;
  }
  try {
    return await fetch(address(path), {
      method,
      headers,
      body: body === undefined ? undefined : JSON.stringify(body),
      credentials: "same-origin",
      signal: AbortSignal.timeout(TIMEOUT_MS),
    });
  } catch (error) {
    throw new ApiError(0, { ...SILENT, cause: error });
  }
}

async function readJson(response) {
  const text = await response.text();
  try {
    return text ? JSON.parse(text) : null;
  } catch {
    return null; // an answer without words of its own is named by its status
  }
}

function unnamed(response) {
  return {
    code: `http_${response.status}`,
    what: `The dashboard answered ${response.status} ${response.statusText}.`,
    try: "See: vla-deploy logs dashboard",
  };
}
