import { noticeFor, tokenIn } from "../../iveg/static/js/pages/signin.js";
import { equal, test } from "./harness.js";

test("the token of a link is what stands behind its #", () => {
  equal(tokenIn("#token=ab12"), "ab12");
  equal(
    ["", "#", "#map-panel"].map((hash) => tokenIn(hash)),
    [null, null, null],
  );
});

test("each refusal has its sentence, and a sign-in has none", () => {
  equal(
    [204, 401, 422, 429, 500, 0].map((status) => noticeFor(status)),
    [
      null,
      "#signin-wrong",
      "#signin-wrong",
      "#signin-wait",
      "#signin-failed",
      "#signin-failed",
    ],
  );
  equal(noticeFor(401, "password"), "#signin-refused");
  equal(noticeFor(401, "invitation"), "#signin-uninvited");
  equal(noticeFor(429, "password"), "#signin-wait");
});

test("an invitation is told from a token", () => {
  equal(tokenIn("#invitation=xy", "invitation"), "xy");
  equal(tokenIn("#invitation=xy"), null);
});
