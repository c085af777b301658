import { noticeFor, tokenIn } from "../../iveg/static/js/pages/signin.js";
import { equal, test } from "./harness.js";

test("the token of a link is what stands behind its #", () => {
  equal(tokenIn("#token=ab12"), "ab12");
  equal(["", "#", "#map-panel"].map(tokenIn), [null, null, null]);
});

test("each refusal has its sentence, and a sign-in has none", () => {
  equal([204, 401, 422, 429, 500, 0].map(noticeFor), [
    null,
    "#signin-wrong",
    "#signin-wrong",
    "#signin-wait",
    "#signin-failed",
    "#signin-failed",
  ]);
});
