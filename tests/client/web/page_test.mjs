// The page in a real browser. OBLIQUE_BIN: the folder of programs; OBLIQUE_NODE_MODULES; OBLIQUE_CHROMIUM;
// OBLIQUE_SCREENSHOTS: where pictures of all views are left, if anywhere.
import assert from "node:assert/strict";
import { after, before, test } from "node:test";
import { begin, browser, end } from "./here.mjs";

before(begin);
after(end);

await import("./overview_tests.mjs");
await import("./study_tests.mjs");
await import("./study/condition_tests.mjs");
await import("./study/choice_tests.mjs");
await import("./study/failure_tests.mjs");
await import("./study/running_tests.mjs");
await import("./study/solving_tests.mjs");
await import("./takeaway_tests.mjs");
await import("./point_tests.mjs");
await import("./looks_tests.mjs");

test("nothing was objected to: no error, no report of the content policy, no request to another host", () => {
  assert.deepEqual(browser.objections, []);
});
