/** Hold what the page says of the last stop. */

import assert from "node:assert/strict";
import { pathToFileURL } from "node:url";
import test from "node:test";

const { lastStopWords } = await import(pathToFileURL(`${process.env.PAGE}/safety_words.js`));
const STOP = { state: "verified", cause: "estop", source: "voice", age_s: 3.2, standstill_s: 0.312, reason: "" };

test("a stop is said to be verified, or why it is not", () => {
  assert.equal(lastStopWords(null), null);
  assert.equal(lastStopWords(STOP).text, "Last stop: VERIFIED, at rest after 0.31 s. Emergency stop (voice), 3 s ago");
  const failed = lastStopWords({ ...STOP, state: "failed", standstill_s: null, reason: "left_wheel still moved" });
  assert.equal(failed.failed, true);
  assert.match(failed.text, /FAILED: left_wheel still moved\. /);
});
