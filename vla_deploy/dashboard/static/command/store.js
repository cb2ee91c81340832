/** Keep the commands of this run: asked from the robot, then followed live. */

import { get } from "../api.js";
import { subscribe } from "../live.js";
import { tell } from "../messages.js";
import { Store, useStore } from "../store.js";
import { useEffect } from "../ui.js";
import { OPEN_STATES, storyOf } from "./story.js";

const KEPT = 50;
const PARTS_KEPT = 100;
const SAME_WITHIN_S = 5; // a mission that begins again says the same later, not sooner
const PART = /^(.+)\/([\w-]+\.[\w-]+)(\+\d+)?$/;
// What is lost is found out by the dashboard and told nowhere else: it is asked while one is open.
const ASK_PERIOD_MS = 5_000;

/** Commands, the newest first: `{command_id, kind, text, source, given_s, events, story, mission, part}`.
 *
 * `mission` is the id of the one that it is a part of, `part` which one of it: both are "" for most.
 */
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
  return open.find(({ story }) => story.state === "asked") ?? given(open).at(-1);
}

/** Return the commands that somebody gave: those of missions come from the missions. */
export function given(all) {
  return all.filter((one) => !one.mission);
}

function isOpen({ story }) {
  return OPEN_STATES.includes(story.state);
}

function begin() {
  const timer = setInterval(() => commands.value.some(isOpen) && ask(), ASK_PERIOD_MS);
  ends = [subscribe("utterance", heard), subscribe("task_event", happened), () => clearInterval(timer)];
  ask();
}

async function ask() {
  try {
    const told = await get(`commands?limit=${KEPT + PARTS_KEPT}`);
    told.filter(({ kind }) => kind === "command").forEach(remember);
  } catch (error) {
    tell("warn", `The history of commands did not come: ${error.what ?? error.message}`);
  }
}

function remember(command) {
  const seen = find(command.command_id);
  if (!seen || seen.events.length <= command.events.length) put(command.command_id, command);
}

function heard({ data, stamp_s }) {
  if (data.cancel || data.answer || data.mission_act || "pause" in data) return;
  const { text, source, plan, mission, heard: evidence } = data;
  const goal = mission && (mission.goal ?? mission.name ?? "mission");
  put(data.command_id, { text: text || goal || "", source, plan, heard: evidence, given_s: stamp_s });
}

function happened({ data, stamp_s }) {
  const event = { ...data, at_s: stamp_s };
  const known = find(data.command_id) ?? partOf(data.command_id, stamp_s);
  if (!known) return ask(); // its words came before this page did
  const isKnown = known.events.some((one) => isSame(one, event));
  return isKnown ? undefined : put(data.command_id, { ...known, events: [...known.events, event] });
}

/** Return the command of a part of a mission: nobody has said it. */
function partOf(command_id, given_s) {
  const [, mission, part] = PART.exec(command_id) ?? [];
  const whole = mission && find(mission);
  if (!whole) return undefined;
  const told = whole.story.objectives.findLast(({ name }) => [part, part.split(".")[0]].includes(name));
  return { text: told?.words ?? "", source: whole.source, given_s, mission, events: [] };
}

/** Tell whether two events are one: the same came live, and was asked for. */
function isSame({ at_s: asked_s, ...asked }, { at_s, ...event }) {
  return Math.abs(asked_s - at_s) < SAME_WITHIN_S && JSON.stringify(asked) === JSON.stringify(event);
}

function find(command_id) {
  return commands.value.find((one) => one.command_id === command_id);
}

function put(command_id, news) {
  const before = find(command_id);
  const command = { command_id, text: "", source: "", mission: "", events: [], ...before, ...news };
  command.part = command.mission ? (PART.exec(command_id)?.[2] ?? "") : "";
  command.story = storyOf(command.events);
  const all = before ? commands.value.map((one) => (one === before ? command : one)) : [command, ...commands.value];
  const sorted = all.toSorted((a, b) => b.given_s - a.given_s);
  const parts = new Set(sorted.filter(({ mission }) => mission).slice(0, PARTS_KEPT));
  const kept = new Set(given(sorted).slice(0, KEPT));
  commands.set(sorted.filter((one) => kept.has(one) || parts.has(one)));
}
