import { Store } from "../../iveg/static/js/core/store.js";
import { believedBy } from "../../iveg/static/js/map/layers/belief.js";
import { createTogether, lesser } from "../../iveg/static/js/pages/alerts_together.js";
import { createAlertList } from "../../iveg/static/js/panels/alert_list.js";
import { createAlertsPanel } from "../../iveg/static/js/panels/alerts.js";
import { createTone } from "../../iveg/static/js/panels/tone.js";
import { createWordAnswer } from "../../iveg/static/js/panels/word_answer.js";
import { equal, test, until } from "./harness.js";

// Nobody has written a note about any alert.
window.fetch = async () => Response.json({ items: [] });
const _PROBE = "<img src=x onerror=window.probed=true>";

/** A store that forgets nothing while the test lasts. */
function memory() {
  /** @type {Map<string, string>} */
  const kept = new Map();
  return /** @type {Storage} */ (
    /** @type {unknown} */ ({
      getItem: (/** @type {string} */ key) => kept.get(key) ?? null,
      setItem: (/** @type {string} */ key, /** @type {string} */ value) =>
        kept.set(key, value),
    })
  );
}

/** @param {object} [differs] */
function alert(differs = {}) {
  return /** @type {import("../../iveg/static/js/core/protocol.js").Alert} */ ({
    alert_id: "a",
    priority: "P1",
    key: "robot_lost",
    slots: { robot: "AGI" },
    robot_id: "AGI",
    raised_at: "2026-11-20T12:00:00Z",
    last_raised_at: "2026-11-20T12:00:00Z",
    cleared_at: null,
    acknowledged_at: null,
    acknowledged_by: null,
    note: null,
    count: 1,
    ...differs,
  });
}

const i18n = /** @type {import("../../iveg/static/js/core/i18n.js").I18n} */ (
  /** @type {unknown} */ ({
    t: (/** @type {string} */ key, /** @type {object} */ slots = {}) =>
      [key, ...Object.values(slots)].join(" "),
    language: () => "es",
    onChange: () => undefined,
  })
);

const SCENE = /** @type {import("../../iveg/static/js/map/scene.js").Scene} */ (
  /** @type {unknown} */ ({
    robots: [{ id: "AGI" }, { id: "AGII" }],
    scans: [{ robotId: "AGI" }, { robotId: "AGII" }],
    detections: [{ robotId: "AGI" }, { robotId: "AGII" }],
    people: [{ observers: ["AGI"] }, { observers: ["AGII"] }],
  })
);

test("a robot that hears no server counts on its own eyes alone", () => {
  const { people, robots } = believedBy(SCENE, "AGII", false);
  equal(people, [{ observers: ["AGII"] }]);
  equal(robots, [{ id: "AGII" }]);
});

test("a P1 sounds at once and until it is acknowledged", () => {
  /** @type {number[]} */
  const heard = [];
  const beep = (/** @type {number} */ hertz) => heard.push(hertz);
  const tone = createTone({ beep, canSound: () => true, storage: memory() });
  tone.sound(true);
  equal([heard.length, tone.isSounding()], [2, true]);
  tone.sound(false);
  equal(tone.isSounding(), false);
});

test("a word that nobody knows is answered in its row; that it is nobody, twice", async () => {
  document.body.dataset.role = "operator";
  const sent = /** @type {object[]} */ ([]);
  const answer = createWordAnswer(i18n, async (_how, _path, body) => {
    sent.push(/** @type {object} */ (body));
    return { status: 204, body: null };
  });
  const slots = { detector: "yolox", word: "tractor" };
  answer.draw(alert({ priority: "P3", key: "unknown_word", slots }));
  const [yes, no] = answer.element.querySelectorAll("button");
  no?.click();
  equal([sent.length, no?.textContent], [0, "words.sure"]);
  no?.click();
  yes?.click();
  equal(sent, [
    { ...slots, is_person: false, sure: true },
    { ...slots, is_person: true, sure: false },
  ]);
});

test("only who may acknowledge is asked to", () => {
  const list = document.createElement("ul");
  const { draw } = createAlertList(list, i18n);
  document.body.dataset.role = "viewer";
  draw([alert()]);
  equal(list.querySelector("form")?.hidden, true);
  document.body.dataset.role = "operator";
  draw([alert()]);
  equal(list.querySelector("form")?.hidden, false);
});

test("a flood is acknowledged by one press by who may, and never a P1 with it", () => {
  const said = document.createElement("p");
  said.id = "acknowledged-together";
  const button = document.createElement("button");
  button.id = "acknowledge-together";
  document.body.append(button, said);
  const seen = { acknowledged_at: "2026-11-20T12:00:00Z" };
  const flood = ["P1", "P2", "P3", "P2"].map((priority) => alert({ priority }));
  equal(
    lesser([...flood, alert({ priority: "P2", ...seen })]).map((one) => one.priority),
    ["P2", "P3", "P2"],
  );
  const { draw } = createTogether(i18n);
  const isHidden = (/** @type {string} */ role, /** @type {number} */ count) => {
    document.body.dataset.role = role;
    draw(flood.slice(0, count));
    return button.hidden;
  };
  equal(
    [isHidden("viewer", 4), isHidden("operator", 3), isHidden("operator", 4)],
    [true, true, false],
  );
});

test("an acknowledgement that failed says so and can be tried again", async () => {
  document.body.dataset.role = "operator";
  const list = document.body.appendChild(document.createElement("ul"));
  createAlertList(list, i18n, async () => 503).draw([alert()]);
  list.querySelector("form")?.requestSubmit();
  // The list redraws a microtask or two after the answer.
  for (let i = 0; i < 5; i += 1) await Promise.resolve();
  equal(list.querySelector("p")?.textContent, "alert.failed 503");
  equal(list.querySelector("form")?.hidden, false);
  list.remove();
});

test("13.10 after an acknowledgement nothing slides under the finger", async () => {
  document.body.dataset.role = "operator";
  const list = document.createElement("ul");
  document.body.append(list);
  const both = [alert({ alert_id: "a" }), alert({ alert_id: "b", priority: "P2" })];
  const { draw } = createAlertList(list, i18n, async () => 200, 150);
  draw(both);
  list.querySelector("button")?.click();
  draw([both[1], alert({ alert_id: "c" })]);
  const ids = () =>
    [...list.children].map((item) => item.querySelector("b")?.textContent);
  equal(ids().length, 2);
  equal(list.children[1].getAttribute("data-priority"), "P2");
  await until(
    () =>
      list.children[1].getAttribute("data-priority") === "P2" &&
      !list.hasAttribute("data-still"),
  );
  equal(ids().length, 2);
  list.remove();
});

/** The bell over a store; what sounded is in `heard`. */
function bell() {
  document.body.replaceChildren();
  for (const id of [
    "alerts-button",
    "alerts-count",
    "alerts-empty",
    "alerts-earlier",
    "alerts-unheard",
  ]) {
    const element = document.createElement(id === "alerts-button" ? "button" : "p");
    element.id = id;
    document.body.append(element);
  }
  const panel = document.createElement("dialog");
  panel.id = "alerts-panel";
  const list = document.createElement("ul");
  list.id = "alerts";
  panel.append(list);
  document.body.append(panel);
  /** @type {string[]} */
  const heard = [];
  const tone = /** @type {import("../../iveg/static/js/panels/tone.js").Tone} */ (
    /** @type {unknown} */ ({
      sound: (/** @type {boolean} */ isOn) => heard.push(isOn ? "loud" : "still"),
      chime: () => heard.push("chime"),
    })
  );
  /** @type {(() => void)[]} */
  const frames = [];
  const store = new Store({ schedule: (flush) => frames.push(flush) });
  const tell = (/** @type {object[]} */ alerts) => {
    store.apply("alerts", alerts);
    flush();
  };
  const flush = () => {
    for (const one of frames.splice(0)) one();
  };
  const heardBy = /** @type {import("../../iveg/static/js/main.js").App} */ (
    /** @type {unknown} */ ({
      store,
      i18n: { ...i18n, onChange: () => {} },
    })
  );
  createAlertsPanel(heardBy, tone);
  return { tell, heard, store, flush };
}

test("a group that holds a P1 sounds, whatever it began as", () => {
  const { tell, heard } = bell();
  tell([alert({ priority: "P3" })]);
  tell([alert({ priority: "P1", count: 2 })]);
  equal(heard.at(-1), "loud");
  equal(document.querySelector("#alerts-button")?.getAttribute("data-worst"), "P1");
  document.body.replaceChildren();
});

test("without the server nobody is told that there are no alerts", () => {
  const { tell, store, flush } = bell();
  const said = () =>
    ["#alerts-empty", "#alerts-unheard"].map((id) =>
      Boolean(document.querySelector(id)?.hasAttribute("hidden")),
    );
  const count = () => document.querySelector("#alerts-count")?.textContent;
  store.setConnection("open");
  store.apply("snapshot", { robots: [], alerts: [] });
  tell([]);
  equal([said(), count()], [[false, true], "0"]);
  store.setConnection("lost");
  flush();
  equal([said(), count()], [[true, false], "0?"]);
  document.body.replaceChildren();
});
