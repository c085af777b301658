import { nextOrder, sortQuery } from "../../iveg/static/js/pages/sorting.js";
import { equal, test } from "./harness.js";

test("28.9: a head sorts by its column, and the next press turns it round", () => {
  equal(nextOrder("robot", "none"), "ascending");
  equal(nextOrder("robot", "ascending"), "descending");
  equal(nextOrder("robot", "descending"), "ascending");
});

test("28.9: times begin with the newest", () => {
  equal(nextOrder("at", "none"), "descending");
  equal(sortQuery("at", "descending"), "&sort=-at");
  equal(sortQuery("kind", "ascending"), "&sort=kind");
});
