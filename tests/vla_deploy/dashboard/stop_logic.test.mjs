/** Hold what the page says and does between a press and control's word that the robot stops. */

import assert from "node:assert/strict";
import { pathToFileURL } from "node:url";
import test from "node:test";

const logic = await import(pathToFileURL(`${process.env.PAGE}/stop_logic.js`));
const LATCHED = { estop_latched: true };

function play(...steps) {
  return steps.reduce((demand, step) => step(demand), logic.demanded(1000));
}

const answer = (door, at_ms, told) => (demand) => logic.answered(demand, door, told, at_ms);

test("a demand waits for an answer", () => {
  const demand = play();
  assert.equal(logic.standing(demand, 1100), "asking");
  assert.equal(logic.sentence(demand, 1100), "Stopping …");
});

test("it tells which door answered and after how long", () => {
  const demand = play(answer("door", 1012, { ok: true }));
  assert.equal(logic.standing(demand, 1100), "pressed");
  assert.equal(logic.sentence(demand, 1100), "Pressed: the stop door after 12 ms.");
  const both = answer("page", 1040, { ok: true })(demand);
  assert.equal(logic.sentence(both, 1100), "Pressed: the dashboard after 40 ms, the stop door after 12 ms.");
});

test("the first answer of a door counts, whatever comes of later presses", () => {
  const demand = play(answer("door", 1012, { ok: true }), answer("door", 9000, { ok: false, why: "gone" }));
  assert.equal(demand.answers.door.ok, true);
  assert.equal(demand.answers.door.after_ms, 12);
});

test("an answer that had failed is replaced by one that has not", () => {
  const demand = play(answer("door", 1012, { ok: false, why: "gone" }), answer("door", 1300, { ok: true }));
  assert.deepEqual(demand.answers.door, { ok: true, why: "", after_ms: 300 });
});

test("control's word ends it, by whichever way it comes", () => {
  const byDoor = play(answer("door", 1270, { ok: true, control: LATCHED }));
  const byLive = play((demand) => logic.heard(demand, LATCHED, 1300));
  for (const demand of [byDoor, byLive]) {
    assert.equal(logic.standing(demand, 2000), "stopped");
    assert.equal(logic.shallGoOn(demand, 2000), false);
  }
  assert.equal(logic.sentence(byDoor, 2000), "Stopped. Pressed: the stop door after 270 ms.");
  assert.equal(logic.sentence(byLive, 2000), "Stopped. Pressed: by another way.");
});

test("a control that is armed or silent is no stop", () => {
  for (const control of [null, undefined, {}, { estop_latched: false }, { estop_latched: "yes" }]) {
    assert.equal(play((demand) => logic.heard(demand, control, 1100)).stopped_ms, null);
  }
});

test("where nobody answers, a person is sent to the robot while the page goes on", () => {
  const demand = play(answer("page", 1100, { ok: false, why: "refused" }));
  assert.equal(logic.standing(demand, 999 + logic.PATIENCE_MS), "asking");
  assert.equal(logic.standing(demand, 1000 + logic.PATIENCE_MS), "unheard");
  assert.match(logic.sentence(demand, 3000), /^Nobody answers\. Press the emergency stop .* keeps pressing\.$/);
});

test("a press without control's word sends a person to the robot, too", () => {
  const demand = play(answer("door", 1012, { ok: true }));
  assert.equal(logic.standing(demand, 1000 + logic.PATIENCE_MS), "unconfirmed");
  assert.match(logic.sentence(demand, 3000), /control does not say that it stopped/);
});

test("it ends at last", () => {
  const demand = play();
  assert.equal(logic.shallGoOn(demand, 999 + logic.LONGEST_MS), true);
  assert.equal(logic.shallGoOn(demand, 1000 + logic.LONGEST_MS), false);
  assert.doesNotMatch(logic.sentence(demand, 1000 + logic.LONGEST_MS), /keeps pressing/);
});

test("a reset is taken for one only after what was under way before the stop", () => {
  const demand = play((before) => logic.heard(before, LATCHED, 1300));
  assert.equal(logic.isOver(demand, { estop_latched: false }, 1500), false);
  assert.equal(logic.isOver(demand, { estop_latched: false }, 2400), true);
  assert.equal(logic.isOver(demand, LATCHED, 2400), false);
  assert.equal(logic.isOver(demand, null, 2400), false);
  assert.equal(logic.isOver(play(), { estop_latched: false }, 9000), false);
});

test("Ctrl and full stop press, and Escape twice", () => {
  const key = (name, more = {}) => ({ key: name, ctrlKey: false, metaKey: false, ...more });
  assert.equal(logic.isStopKey(key(".", { ctrlKey: true }), -Infinity, 0), true);
  assert.equal(logic.isStopKey(key(".", { metaKey: true }), -Infinity, 0), true);
  assert.equal(logic.isStopKey(key("."), -Infinity, 0), false);
  assert.equal(logic.isStopKey(key("Escape"), -Infinity, 5000), false);
  assert.equal(logic.isStopKey(key("Escape"), 4300, 5000), true);
  assert.equal(logic.isStopKey(key("Escape"), 4200, 5000), false);
  assert.equal(logic.isStopKey(key("a"), 4900, 5000), false);
});

test("each door has its address; without a stop door the dashboard is left", () => {
  const base = "http://robot:8088/sub/";
  assert.deepEqual(logic.addresses(base, "http://robot:8089"), {
    page: "http://robot:8088/sub/api/v1/stop",
    door: "http://robot:8089/stop",
  });
  assert.deepEqual(Object.keys(logic.addresses(base, "")), ["page"]);
});
