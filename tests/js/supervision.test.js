import { Store } from "../../iveg/static/js/core/store.js";
import { createWakeLock } from "../../iveg/static/js/core/wakelock.js";
import { believedBy, hears } from "../../iveg/static/js/map/layers/belief.js";
import { laidTo, lengthOf } from "../../iveg/static/js/map/layers/measure.js";
import { createTogether, lesser } from "../../iveg/static/js/pages/alerts_together.js";
import { soon } from "../../iveg/static/js/pages/rows.js";
import { tilesOf } from "../../iveg/static/js/pages/tiles.js";
import { createAlertList } from "../../iveg/static/js/panels/alert_list.js";
import { floodSaid } from "../../iveg/static/js/panels/alert_members.js";
import { createAlertsPanel } from "../../iveg/static/js/panels/alerts.js";
import { createHints } from "../../iveg/static/js/panels/hints.js";
import { faultsSaid } from "../../iveg/static/js/panels/robot_texts.js";
import { createTone, openWhenTouched } from "../../iveg/static/js/panels/tone.js";
import { equal, near, test, until } from "./harness.js";

// Nobody has written a note about any alert.
window.fetch = async () => Response.json({ items: [] });
const PROBE = "<img src=x onerror=window.probed=true>";

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
    told: [],
    members: [],
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

test("a robot's card says what the robot finds wrong with its own data", () => {
  const robot = /** @type {import("../../iveg/static/js/core/protocol.js").Robot} */ (
    /** @type {unknown} */ ({
      applied: {
        faults: [
          { code: "no_transform", about: "map → odom", for_s: 2.1 },
          { code: "unheard_of", about: "/scan", for_s: null },
        ],
      },
    })
  );
  const known = (/** @type {string} */ key) => key === "robot.fault.no_transform";
  equal(faultsSaid(robot, { ...i18n, has: known }), [
    "robot.fault_for robot.fault.no_transform no_transform map → odom 2.1",
    "robot.fault.other unheard_of /scan",
  ]);
  equal(faultsSaid({ ...robot, applied: null }, i18n), []);
});

test("a tape is laid with two taps, and a third begins anew", () => {
  const first = laidTo({ points: [] }, { x: 1, y: 1 });
  equal(lengthOf(first), null);
  const second = laidTo(first, { x: 4, y: 5 });
  near(lengthOf(second) ?? 0, 5);
  equal(laidTo(second, { x: 9, y: 9 }).points, [{ x: 9, y: 9 }]);
});

const SCENE = /** @type {import("../../iveg/static/js/map/scene.js").Scene} */ (
  /** @type {unknown} */ ({
    robots: [{ id: "AGI" }, { id: "AGII" }],
    scans: [{ robotId: "AGI" }, { robotId: "AGII" }],
    detections: [{ robotId: "AGI" }, { robotId: "AGII" }],
    people: [{ observers: ["AGI"] }, { observers: ["AGII"] }],
  })
);

test("a robot knows its own scan and, by the server, everybody's people", () => {
  const { scans, detections, people, robots } = believedBy(SCENE, "AGII", true);
  equal([scans.length, detections.length], [1, 1]);
  equal([people.length, robots.length], [2, 2]);
});

test("a robot that hears no server counts on its own eyes alone", () => {
  const { people, robots } = believedBy(SCENE, "AGII", false);
  equal(people, [{ observers: ["AGII"] }]);
  equal(robots, [{ id: "AGII" }]);
});

test("whether a robot hears is what it says of its newest feedback", () => {
  const robot = (/** @type {number | null} */ feedback_age_s) =>
    /** @type {import("../../iveg/static/js/core/protocol.js").Robot} */ (
      /** @type {unknown} */ ({ applied: { feedback_age_s } })
    );
  equal(
    [0.2, 3.1, null].map((age) => hears(robot(age))),
    [true, false, false],
  );
  equal(hears(undefined), false);
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

test("a chime can be silenced and that is remembered; a P1 cannot", () => {
  /** @type {number[]} */
  const heard = [];
  const beep = (/** @type {number} */ hertz) => heard.push(hertz);
  const storage = memory();
  createTone({ beep, canSound: () => true, storage }).setChimes(false);
  const tone = createTone({ beep, canSound: () => true, storage });
  tone.chime();
  equal(heard.length, 0);
  tone.sound(true);
  tone.sound(false);
  equal(heard.length, 2);
});

test("a browser that may not sound yet is told apart from one that did", () => {
  const tone = createTone({ beep: () => {}, canSound: () => false, storage: memory() });
  equal(tone.test(), false);
});

test("audio is started by the first touch and not by the first alert", async () => {
  const page = new EventTarget();
  let [made, suspended] = [0, 0];
  const context = {
    suspend: async () => {
      suspended += 1;
    },
  };
  const open = openWhenTouched(
    () => {
      made += 1;
      return /** @type {AudioContext} */ (/** @type {unknown} */ (context));
    },
    /** @type {typeof globalThis} */ (page),
  );
  equal(made, 0);
  page.dispatchEvent(new Event("click"));
  equal(made, 0); // the touch may be a press of STOP
  await new Promise((done) => setTimeout(done, 20));
  equal([made, suspended], [1, 1]);
  equal([open() === /** @type {unknown} */ (context), made], [true, 1]);
});

test("the screen stays on while somebody supervises, and not longer", async () => {
  let released = 0;
  const sentinel = {
    released: false,
    release: async () => {
      released += 1;
    },
  };
  const locker = { request: async () => sentinel };
  const lock = createWakeLock({ locker, storage: memory() });
  equal(lock.isHeld(), false);
  await lock.supervise();
  equal(lock.isHeld(), true);
  await lock.setWanted(false);
  equal([lock.isHeld(), released], [false, 1]);
});

test("a browser that refuses the lock is asked again, not complained of", async () => {
  let asked = 0;
  const locker = {
    request: async () => {
      asked += 1;
      throw new DOMException("low battery", "NotAllowedError");
    },
  };
  const lock = createWakeLock({ locker, storage: memory() });
  await lock.supervise();
  await lock.supervise();
  equal([asked, lock.isHeld()], [2, false]);
});

test("notes and names in alerts are text, whatever they hold", () => {
  const list = document.createElement("ul");
  const draw = createAlertList(list, i18n).draw;
  draw([alert({ note: PROBE, acknowledged_by: PROBE, slots: { robot: PROBE } })]);
  equal(list.querySelectorAll("img").length, 0);
  equal(list.textContent?.includes(PROBE), true);
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

test("an alert that did not change is not drawn again when another did", () => {
  let told = 0;
  const counting = { ...i18n, t: (/** @type {string} */ key) => `${key}${told++}` };
  const { draw } = createAlertList(document.createElement("ul"), counting);
  draw([alert({ alert_id: "a" })]);
  const once = told;
  draw([alert({ alert_id: "a" })]);
  equal(told, once);
  draw([alert({ alert_id: "a", count: 2 })]);
  equal(told > once, true);
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

test("an alert that is over and now seen offers no button until its row goes", async () => {
  document.body.dataset.role = "operator";
  const list = document.body.appendChild(document.createElement("ul"));
  const { draw } = createAlertList(list, i18n, async () => 200, 150);
  draw([alert({ cleared_at: "2026-11-20T12:01:00Z" })]);
  list.querySelector("form")?.requestSubmit();
  draw([]);
  await until(() => list.querySelector("form")?.hidden === true);
  equal(list.children.length, 1);
  await until(() => list.children.length === 0);
  list.remove();
});

test("an alert that comes back while its row stands still has its button again", async () => {
  document.body.dataset.role = "operator";
  const list = document.body.appendChild(document.createElement("ul"));
  const over = alert({ cleared_at: "2026-11-20T12:01:00Z" });
  const { draw } = createAlertList(list, i18n, async () => 200, 150);
  draw([over]);
  list.querySelector("form")?.requestSubmit();
  draw([]);
  equal(list.querySelector("form")?.hidden, true);
  draw([over]);
  // The answer to the acknowledgement comes after the alert has.
  for (let i = 0; i < 5; i += 1) await Promise.resolve();
  equal(list.querySelector("form")?.hidden, false);
  list.remove();
});

test("13.10 the gravest stands first, of these the oldest", () => {
  const list = document.createElement("ul");
  createAlertList(list, i18n).draw([
    alert({ alert_id: "p2", priority: "P2", key: "late" }),
    alert({ alert_id: "p1", key: "young", raised_at: "2026-11-20T12:05:00Z" }),
    alert({ alert_id: "over", key: "old", cleared_at: "2026-11-20T12:01:00Z" }),
  ]);
  const shown = [...list.children].map((item) => item.getAttribute("data-alert"));
  equal(shown, ["old", "young", "late"]);
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

/** @param {string} at @param {object} [differs] */
function occurrence(at, differs = {}) {
  return {
    priority: "P2",
    raised_at: at,
    cleared_at: null,
    acknowledged_at: null,
    acknowledged_by: null,
    note: null,
    ...differs,
  };
}

test("an alert that repeats is one row that tells each time", () => {
  const list = document.createElement("ul");
  const members = [
    occurrence("2026-11-20T12:00:00Z", { note: PROBE }),
    occurrence("2026-11-20T12:07:00Z"),
  ];
  createAlertList(list, i18n).draw([alert({ count: 2, members })]);
  const said = [...list.querySelectorAll(".members li")].map((one) => one.textContent);
  equal(list.children.length, 1);
  equal(
    [said.length, said[0]?.includes("12:07"), said[1]?.includes(PROBE)],
    [2, true, true],
  );
});

test("whoever reads the occurrences keeps reading while more come", () => {
  const list = document.createElement("ul");
  const { draw } = createAlertList(list, i18n);
  const members = [
    occurrence("2026-11-20T12:00:00Z"),
    occurrence("2026-11-20T12:07:00Z"),
  ];
  draw([alert({ count: 2, members })]);
  const details = /** @type {HTMLDetailsElement} */ (list.querySelector(".members"));
  details.open = true;
  draw([
    alert({ count: 3, members: [...members, occurrence("2026-11-20T12:09:00Z")] }),
  ]);
  equal([list.contains(details), details.open], [true, true]);
  equal(details.querySelectorAll("li").length, 3);
});

test("13.23 an alert says who was told outside the page, and who could not be", () => {
  const element = document.createElement("ul");
  const list = createAlertList(element, i18n);
  const told = [
    { channel: "email", to: "Ana", at: "2026-11-20T12:00:01Z", failed: null },
    { channel: "push", to: "", at: "2026-11-20T12:00:02Z", failed: "no_answer" },
  ];
  list.draw([alert({ told })]);
  const facts = element.querySelector("small")?.textContent ?? "";
  equal(
    facts
      .split(" · ")
      .slice(-2)
      .map((one) => one.trim()),
    [
      "messages.told Ana messages.channel.email 2026-11-20T12:00:01Z",
      "messages.told_failed messages.everybody messages.channel.push " +
        "2026-11-20T12:00:02Z messages.why.no_answer",
    ],
  );
});

test("what happened once has nothing to open", () => {
  const list = document.createElement("ul");
  createAlertList(list, i18n).draw([alert()]);
  equal(/** @type {any} */ (list.querySelector(".members")).hidden, true);
});

test("a row has what and since when; what is behind it opens of the gravest alone", () => {
  document.body.dataset.role = "operator";
  const list = document.createElement("ul");
  const { draw } = createAlertList(list, i18n);
  const seen = { acknowledged_at: "2026-11-20T12:00:00Z", acknowledged_by: "ana" };
  const alerts = [
    ...["a", "b", "c"].map((alert_id) => alert({ alert_id })),
    alert({ alert_id: "d", ...seen }),
    alert({ alert_id: "e", priority: "P2" }),
  ];
  const rows = () => [...list.querySelectorAll("li > details")];
  draw(alerts);
  equal(
    rows().map((row) => row.hasAttribute("open")),
    [true, true, false, false, false],
  );
  const [first] = rows();
  const parts = [
    ...(first.querySelector("summary")?.querySelectorAll("b, small") ?? []),
  ];
  equal(parts.length, 2);
  equal(first.querySelector("summary form, summary a"), null);
  rows()[4].setAttribute("open", "");
  draw(alerts.map((one) => ({ ...one, count: 2 })));
  equal(rows()[4].hasAttribute("open"), true);
});

test("a flood is told apart from a rate that a person can bear", () => {
  const calm = { count: 3, limit: 10, window_s: 600, since: null };
  equal(floodSaid(calm, i18n), "alert.rate 3 10 10 ");
  const flood = { ...calm, count: 12, since: "2026-11-20T12:00:00Z" };
  equal(floodSaid(flood, i18n), "alert.flood 12 10 10 2026-11-20T12:00:00Z");
  equal(floodSaid(undefined, i18n), "");
});

/** The bell over a store; what sounded is in `heard`. */
function bell() {
  document.body.replaceChildren();
  for (const id of [
    "alerts-button",
    "alerts-count",
    "alerts-flood",
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
  return { tell, heard, panel, list, store, flush };
}

test("each time that a group repeats it chimes, and once", () => {
  const { tell, heard } = bell();
  tell([]);
  tell([alert({ priority: "P2" })]);
  tell([alert({ priority: "P2" })]);
  tell([alert({ priority: "P2", count: 2 })]);
  equal(
    heard.filter((one) => one === "chime"),
    ["chime", "chime"],
  );
});

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

test("a list that is closed is not written with each change, the bell is", () => {
  const { tell, panel, list } = bell();
  const said = () => list.querySelector("small")?.textContent ?? "";
  const count = () => document.querySelector("#alerts-count")?.textContent;
  tell([alert()]);
  tell([alert(), alert({ alert_id: "second" })]);
  equal([list.children.length, count()], [0, "2"]);
  panel.show();
  document.dispatchEvent(new CustomEvent("iveg:panel"));
  equal([list.children.length, said() !== ""], [2, true]);
  document.body.replaceChildren();
});

/** Nothing measured yet. */
function nothing() {
  const none = { count: 0, age_s: null, since: null };
  return /** @type {import("../../iveg/static/js/core/protocol.js").Safety} */ ({
    alert_latency: { ...none, p50_ms: null, p95_ms: null, p99_ms: null, window_s: 300 },
    not_echoed: { ...none, of: 0, within_s: 1, window_s: 300 },
    negative_margin: { ...none, share: null, known_s: 0, unknown_s: 0 },
    worst_margin: { ...none, margin: null, at: null },
  });
}

test("what was not measured is no zero", () => {
  const values = Object.values(tilesOf(nothing(), 0, i18n)).map(({ value }) => value);
  equal(values, ["—", "—", "—", "—"]);
});

test("an order that nobody missed is a zero of so many", () => {
  const safety = nothing();
  safety.not_echoed = { count: 0, of: 7, within_s: 1, window_s: 300, age_s: 2 };
  const { value } = tilesOf(safety, 0, i18n).echo;
  equal(value.startsWith("tiles.echo_value 0 7 "), true);
});

test("the age of a tile grows while the server is silent", () => {
  const safety = nothing();
  safety.alert_latency = {
    ...{ p50_ms: 120, p95_ms: 240, p99_ms: 310 },
    ...{ count: 8, window_s: 300, age_s: 3 },
  };
  const { of } = tilesOf(safety, 4, i18n).latency;
  equal(of, "tiles.latency_of 120 240 310 8 300 3 5 7 20");
});

test("13.11 quantiles are told of twenty values or more", () => {
  const safety = nothing();
  const some = { p50_ms: 120, p95_ms: 240, p99_ms: 310, window_s: 300, age_s: 3 };
  const said = [19, 20].map((count) => {
    safety.alert_latency = { ...some, count };
    return tilesOf(safety, 0, i18n).latency.value.split(" ")[0];
  });
  equal(said, ["tiles.too_few", "tiles.latency_value"]);
});

test("a table is read anew while events never end", async () => {
  let reads = 0;
  const ask = soon(() => {
    reads += 1;
  }, 20);
  const events = setInterval(ask, 5);
  await until(() => reads >= 3).finally(() => clearInterval(events));
});

test("several events at once are one reading, and one more for what came after", async () => {
  let reads = 0;
  const ask = soon(() => {
    reads += 1;
  }, 20);
  ask();
  await until(() => reads === 1);
  for (let i = 0; i < 9; i += 1) ask();
  await until(() => reads === 3);
});

test("hints come one after the other, end where somebody says so, and stay away", () => {
  const box = document.createElement("div");
  box.id = "hints";
  const parts = ["said", "next", "end"].map((name) => {
    const part = document.createElement("button");
    part.id = `hints-${name}`;
    return part;
  });
  box.append(...parts);
  document.body.append(box);
  const [said, next, end] = parts;
  const seen = () => (box.hidden ? null : said.textContent?.split(" ").pop());
  const kept = memory();
  createHints({ i18n }, kept);
  const first = seen();
  next.click();
  equal([first, seen()], ["hints.stop", "hints.line"]);
  createHints({ i18n }, kept);
  equal(seen(), "hints.line");
  end.click();
  equal(seen(), null);
  createHints({ i18n }, kept);
  equal(seen(), null);
});
