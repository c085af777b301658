import {
  saidOfOrder,
  whyNotRelease,
  whyNotResume,
} from "../../iveg/static/js/panels/release.js";
import { command, robot } from "./builders.js";
import { equal, test } from "./harness.js";

/** @typedef {import("../../iveg/static/js/panels/release.js").Facts} Facts */

const IVEG = /** @type {const} */ ({ id: "01A", source: "iveg", ack: "remote" });
const RED_BUTTON = /** @type {const} */ ({ id: "hw", source: "hw", ack: "local" });
const _LINK = { id: "link", source: "link", ack: "auto" };
const STILL = { linear: 0.001, angular: 0 };

/** A robot that stands, proven, held by iVeg. @param {Partial<Facts>} [changes] */
function facts(changes = {}) {
  return {
    connection: /** @type {const} */ ("open"),
    role: "operator",
    ageS: 0.1,
    robot: robot({ mode: "STOPPED", holds: [IVEG], twist: STILL }),
    command: command({ kind: "stop", state: "STANDING" }),
    ...changes,
  };
}

test("an operator may release a robot that is proven to stand", () => {
  equal(whyNotRelease(facts()), "ok");
});

test("a viewer may not release, and may not resume", () => {
  equal(whyNotRelease(facts({ role: "viewer" })), "role");
  equal(whyNotResume(facts({ role: "viewer" })), "role");
});

test("nothing is released on old news or without a server", () => {
  equal(whyNotRelease(facts({ ageS: 1.2 })), "not_fresh");
  equal(whyNotRelease(facts({ connection: "lost" })), "no_link");
});

test("f42 whoever was signed out has to sign in again to release or resume", () => {
  equal(whyNotRelease(facts({ connection: "signed-out" })), "signed_out");
  equal(whyNotResume(facts({ connection: "signed-out" })), "signed_out");
});

test("a robot that still brakes is not released", () => {
  const braking = command({ kind: "stop", state: "DELIVERED" });
  equal(whyNotRelease(facts({ command: braking })), "not_standing");
});

test("a hold that iVeg did not make needs a standing robot all the same", () => {
  const boot = /** @type {const} */ ({ id: "boot-1", source: "boot", ack: "remote" });
  const held = robot({ mode: "STOPPED", holds: [boot], twist: STILL });
  const rolling = robot({ ...held, twist: { linear: 0.1, angular: 0 } });
  equal(whyNotRelease(facts({ command: undefined, robot: held })), "ok");
  equal(whyNotRelease(facts({ command: undefined, robot: rolling })), "not_standing");
});

test("the robot's own red button cannot be lifted from here", () => {
  const held = robot({ mode: "STOPPED", holds: [RED_BUTTON], twist: STILL });
  equal(whyNotRelease(facts({ robot: held })), "local_hold");
});

test("a robot is resumed only after it reported its release", () => {
  const free = robot({ mode: "STOPPED", holds: [], twist: STILL });
  const ready = command({ kind: "stop", state: "READY" });
  const releasing = command({ kind: "stop", state: "RELEASING" });
  equal(whyNotResume(facts({ robot: free, command: ready })), "ok");
  equal(whyNotResume(facts({ robot: free, command: releasing })), "not_ready");
  equal(whyNotResume(facts({ command: ready })), "not_ready");
});

/** Key of what is said of a release. @param {Partial<import("../../iveg/static/js/core/protocol.js").Command>} changes */
function said(changes) {
  return saidOfOrder(command({ kind: "release", ...changes })).key;
}

test("a release says how it ended, and never more than the robot did", () => {
  equal(said({ state: "RELEASING" }), "release.sent");
  equal(said({ state: "READY" }), "release.confirmed");
  equal(said({ state: "STANDING", reason: "challenge" }), "release.refused");
  equal(
    said({ state: "EXPIRED", reason: "release_unconfirmed" }),
    "release.unconfirmed",
  );
  equal(said({ state: "REPLACED", reason: "requested" }), "release.replaced");
});
