import { asksForProof, saidOfProof } from "../../iveg/static/js/panels/proof.js";
import { countdown, leftOf, saidOfPin } from "../../iveg/static/js/panels/tablet.js";
import { equal, test } from "./harness.js";

const tablet = { name: "T", holder: "Ana", role: "operator", left_s: 100, people: [] };

test("a tablet that was told too long ago counts as locked", () => {
  const left = [0, 60, 100, 400].map((ago) => leftOf(/** @type {any} */ (tablet), ago));
  equal(left.join(), "100,40,0,0");
  equal(leftOf(/** @type {any} */ ({ ...tablet, holder: null }), 0), 0);
});

test("what is left is a clock", () => {
  equal([100, 59.2, 1, 0, 3600].map(countdown).join(), "1:40,1:00,0:01,0:00,60:00");
});

test("a refused PIN says how many tries are left, or how long to wait", () => {
  const said = (/** @type {number} */ status, /** @type {object | null} */ body) =>
    saidOfPin({ status, body });
  equal(said(403, { left: 2, blocked_s: 0 }).key, "tablet.wrong");
  equal(said(403, { left: 5, blocked_s: 60 }).key, "tablet.blocked");
  equal(said(429, { blocked_s: 60 }).slots.wait, "1:00");
  equal(said(0, null).key, "rows.offline");
  equal(said(500, null).key, "tablet.failed");
});

test("only a release that wants a proof asks for one", () => {
  const asks = (/** @type {number} */ status, /** @type {string} */ type) =>
    asksForProof({ status, body: { type } });
  equal(asks(403, "urn:iveg:proof-needed"), true);
  equal(asks(403, "urn:iveg:not-allowed"), false);
  equal(asksForProof({ status: 0, body: null }), false);
  equal(saidOfProof(204), null);
  equal(
    [403, 422, 429, 0].map(saidOfProof).join(),
    "proof.wrong,proof.wrong,proof.wait,proof.failed",
  );
});
