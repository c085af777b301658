import { UnreadPresses } from "../../iveg/static/js/core/presses.js";
import { retryDelay } from "../../iveg/static/js/core/socket.js";
import { equal, test } from "./harness.js";

const PRESS = { robotId: null, pressId: "a", pressedAt: 1 };

test("tries come quickly at first and never less often than every 0.9 s", () => {
  const longest = [0, 1, 2, 3, 4, 50].map((tries) => retryDelay(tries, 1));
  equal(longest, [250, 500, 900, 900, 900, 900]);
  equal(retryDelay(0, 0), 150);
});

test("a press is kept until a ping sent after it is answered", () => {
  const presses = new UnreadPresses();
  presses.add(PRESS);
  presses.confirm(1000);
  equal(presses.size, 1);
  presses.add(PRESS, 2000);
  presses.confirm(1999);
  equal(presses.size, 1);
  presses.confirm(2000);
  equal(presses.size, 0);
});

test("a press repeated is one press", () => {
  const presses = new UnreadPresses();
  presses.add(PRESS);
  presses.add(PRESS);
  equal(presses.size, 1);
});
