/** Keep the commands of this run: asked from the robot, then followed live. */

import { get } from "../api.js";
import { subscribe } from "../live.js";
import { tell } from "../messages.js";
import { Store, useStore } from "../store.js";
import { useEffect } from "../ui.js";
import { OPEN_STATES, storyOf } from "./story.js";

const KEPT = 50;
// What is lost is found out by the dashboard and told nowhere else: it is asked while one is open.
const ASK_PERIOD_MS = 5_000;

/** Commands, the newest first: `{command_id, kind, text, source, given_s, events, story}`. */
export const commands = new Store([]);

let followers = 0;
let ends = [];

/** Return the commands, and follow them while a view shows them. */
export function useCommands() {
  useEffect(() => {
    if (followers++ === 0) begin();
    return () => {
      if (--followers === 0) ends.forEach((end) => end());
    };
  }, []);
  return useStore(commands);
}

/** Return the command that is under way or waits, one that asks first; else undefined. */
export function openCommand(all) {
  const open = all.filter(isOpen);
  return open.find(({ story }) => story.state === "asked") ?? open.at(-1);
}

function isOpen({ story }) {
  return OPEN_STATES.includes(story.state);
}

function begin() {
  const timer = setInterval(() => commands.value.some(isOpen) && ask(), ASK_PERIOD_MS);
  ends = [subscribe("utterance", given), subscribe("task_event", happened), () => clearInterval(timer)];
  ask();
}

async function ask() {
  try {
    const told = await get(`commands?limit=${KEPT}`);
    told.filter(({ kind }) => kind === "command").forEach(remember);
  } catch (error) {
    tell("warn", `The history of commands did not come: ${error.what ?? error.message}`);
  }
}

function remember(command) {
  const seen = find(command.command_id);
  if (!seen || seen.events.length <= command.events.length) put(command.command_id, command);
}

function given({ data, stamp_s }) {
  if (data.cancel || data.answer) return;
  const { text, source, plan, heard } = data;
  put(data.command_id, { text: text ?? "", source, plan, heard, given_s: stamp_s });
}

function happened({ data }) {
  const known = find(data.command_id);
  if (!known) return ask(); // its words came before this page did
  const isKnown = known.events.some((one) => isSame(one, data));
  return isKnown ? undefined : put(data.command_id, { events: [...known.events, data] });
}

/** Tell whether two events are one: what was asked for carries the time besides. */
function isSame({ at_s: _, ...asked }, event) {
  return JSON.stringify(asked) === JSON.stringify(event);
}

function find(command_id) {
  return commands.value.find((one) => one.command_id === command_id);
}

function put(command_id, news) {
  const before = find(command_id);
  const command = { command_id, text: "", source: "", events: [], ...before, ...news };
  command.story = storyOf(command.events);
  const all = before ? commands.value.map((one) => (one === before ? command : one)) : [command, ...commands.value];
  commands.set(all.toSorted((a, b) => b.given_s - a.given_s).slice(0, KEPT));
}
