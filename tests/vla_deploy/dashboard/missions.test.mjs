/** Hold how the page lays out what each part of the robot did, and how it reads a mission's events. */

import assert from "node:assert/strict";
import { pathToFileURL } from "node:url";
import test from "node:test";

const of = (name) => import(pathToFileURL(`${process.env.PAGE}/${name}`));
const { lanesOf, newestMoment, sinceBegin } = await of("missions/lanes.js");
const { storyOf } = await of("command/story.js");

const span = (skill, parts, begin_s, end_s, status = "succeeded", subtask = "o1.s1") => ({
  subtask, action_id: "a1", skill, parts, begin_s, end_s, status,
});
const mission = (spans, part = { state: "executing", begin_s: 100, end_s: null }) => ({
  given_unix_s: 90, spans, subtasks: { "o1.s1": part }, objectives: {},
});

test("a lane for each part, in the order of the body, with shares of the whole time", () => {
  const drawn = lanesOf(mission([span("speak", ["speaker"], 120, 130), span("drive", ["base"], 100, 120)]), 140);
  assert.deepEqual(drawn.lanes.map(({ part }) => part), ["base", "speaker"]);
  const [speak] = drawn.lanes[1].bars;
  assert.equal(speak.left.toFixed(3), "0.667");
  assert.equal(speak.width.toFixed(3), "0.333");
});

test("what overlaps in a lane is drawn in rows, what follows in one", () => {
  const { lanes } = lanesOf(mission([span("a", ["left"], 0, 10), span("b", ["left"], 5, 12), span("c", ["left"], 10, 20)]), 20);
  assert.equal(lanes[0].rows, 2);
  assert.deepEqual(lanes[0].bars.map(({ row }) => row), [0, 1, 0]);
});

test("what goes on reaches to now, and what nobody ended to the end of its part", () => {
  const open = [span("take", ["left"], 100, null, "active")];
  const ended = (made) => lanesOf(made, 150).lanes[0].bars[0].span;
  assert.deepEqual([ended(mission(open)).end_s, ended(mission(open)).status], [150, "active"]);
  const cancelled = mission(open, { state: "cancelled", begin_s: 100, end_s: 110 });
  assert.deepEqual([ended(cancelled).end_s, ended(cancelled).status], [110, "cancelled"]);
});

test("an action without parts has a lane, a mission without actions none", () => {
  assert.equal(lanesOf(mission([span("wait", [], 0, 10)]), 10).lanes[0].part, "no part");
  assert.equal(lanesOf(mission([]), 10), null);
});

test("a long mission scrolls up to a bound, or is shown whole; its ticks do not crowd", () => {
  const long = mission([span("drive", ["base"], 0, 3600)]);
  for (const [isWhole, width_px] of [[false, 4000], [true, 240]]) {
    const drawn = lanesOf(long, 3600, isWhole);
    assert.equal(drawn.width_px, width_px);
    assert.ok(((drawn.ticks_s[1] - drawn.ticks_s[0]) / 3600) * width_px >= 72);
  }
});

test("moments", () => {
  assert.deepEqual([0, 65, 3725].map(sinceBegin), ["0:00", "1:05", "1:02:05"]);
  assert.equal(newestMoment([mission([span("drive", ["base"], 0, 120)])]), 120);
  assert.equal(newestMoment([]), 0);
});

const objective = (part, state) => ({ event: "objective", part, words: part, state, error: null, note: null });
const done = { event: "finished", success: true, error: null, actions: [] };

test("a mission's story has its objectives, and begins anew with its next time", () => {
  const once = [{ event: "accepted" }, objective("o1", "executing"), objective("o1", "completed")];
  assert.deepEqual(storyOf(once).objectives.map(({ state }) => state), ["completed"]);
  assert.equal(storyOf([...once, done]).state, "done");
  const again = storyOf([...once, done, objective("o1", "executing")]);
  assert.equal(again.state, "running");
  assert.deepEqual(again.objectives.map(({ state }) => state), ["executing"]);
});

test("what a person ended is cancelled, and not failed", () => {
  for (const error of ["cancelled on request", "stopped on request"]) {
    assert.equal(storyOf([{ event: "accepted" }, { ...done, success: false, error }]).state, "cancelled");
  }
  assert.equal(storyOf([{ event: "accepted" }, { ...done, success: false, error: "it fell" }]).state, "failed");
});
