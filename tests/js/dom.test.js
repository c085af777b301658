import { make, setDisabled, setText } from "../../iveg/static/js/panels/dom.js";
import { equal, test } from "./harness.js";

test("a text in place of another keeps its node, and none leaves none behind", () => {
  const place = make("p", "", "one");
  const node = place.firstChild;
  setText(place, "two");
  equal([place.firstChild === node, place.textContent], [true, "two"]);
  setText(place, "");
  equal(place.childNodes.length, 0);
  setText(place, "three");
  equal(place.textContent, "three");
});

test("a text takes the place of all that was there", () => {
  const place = make("p", "", "one");
  place.append(make("b", "", "two"));
  setText(place, "three");
  equal([place.childNodes.length, place.textContent], [1, "three"]);
});

test("a button that is as it was is not written", async () => {
  const button = make("button");
  let changes = 0;
  const observer = new MutationObserver((found) => {
    changes += found.length;
  });
  observer.observe(button, { attributes: true });
  for (const disabled of [false, true, true, false, false])
    setDisabled(button, disabled);
  await Promise.resolve();
  changes += observer.takeRecords().length;
  equal(changes, 2);
});
