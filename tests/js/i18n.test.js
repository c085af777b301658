import { createI18n, translate } from "../../iveg/static/js/core/i18n.js";
import { laneName } from "../../iveg/static/js/core/lanes.js";
import { equal, test } from "./harness.js";

const BLOCKS = {
  es: {
    nav: { live: "En directo" },
    d: "a {distance:1} m ({confidence:percent}), {class:a}, {at:time}",
    plain: "{a} y {b}",
    by: "{by:who}",
    who: { operator: "operador" },
    log: { down: { default: "bajó", person: "bajó por una persona" } },
    class: { a: { person: "una persona" } },
    alert: { lost: "{robot} perdido" },
    raised: "Alarma: {alert:sentence}",
  },
  en: { nav: { live: "Live" }, d: "{distance:1} m", plain: "{a} and {b}" },
};

/** @param {"es" | "en"} language */
async function words(language) {
  const loaded = createI18n(async (wanted) => BLOCKS[wanted]);
  await loaded.use(language);
  return loaded;
}

test("numbers, shares, classes and times are written as Spaniards do", async () => {
  const { t } = await words("es");
  const slots = {
    distance: 1.43,
    confidence: 0.94,
    class: "person",
    at: "2026-11-20T12:04:11Z",
  };
  equal(
    t("d", slots).replaceAll("\u00a0", " "),
    "a 1,4 m (94 %), una persona, 13:04:11",
  );
});

test("a role is told in the reader's language, a name as it is", async () => {
  const { t } = await words("es");
  equal([t("by", { by: "operator" }), t("by", { by: "Ana" })], ["operador", "Ana"]);
});

test("numbers are written as the English do after a switch", async () => {
  const loaded = await words("es");
  await loaded.use("en");
  equal(loaded.t("d", { distance: 1.43 }), "1.4 m");
});

test("listeners are called after a switch, and no more once they have ended", async () => {
  const loaded = await words("es");
  /** @type {string[]} */
  const heard = [];
  const end = loaded.onChange(() => heard.push(loaded.t("nav.live")));
  await loaded.use("en");
  end();
  await loaded.use("es");
  equal([heard, loaded.language()], [["Live"], "es"]);
});

test("summer time is Madrid's", async () => {
  const { time } = await words("es");
  equal(time("2026-07-01T10:00:00Z"), "12:00:00");
});

test("a block answers for itself and for names that it lacks", async () => {
  const { t } = await words("es");
  equal(t("log.down"), "bajó");
  equal(t("log.down.person"), "bajó por una persona");
  equal(t("log.down.never_heard_of"), "bajó");
});

test("a person's number never reads as a priority", async () => {
  const loaded = createI18n(async () => ({
    who: "{person:person}",
    class: { person: "persona", track: { P: "persona {n}", R: "robot {n}" } },
  }));
  await loaded.use("es");
  const said = ["P3-5f0c9a12", "R12", "person", "AGII"].map((person) =>
    loaded.t("who", { person }),
  );
  equal(said, ["persona 3", "robot 12", "persona", "AGII"]);
});

test("a hole without a value shows that there is none", async () => {
  const { t } = await words("es");
  equal(t("plain", { a: null }), "— y —");
});

test("an unknown sentence shows its name", async () => {
  const { t, has } = await words("es");
  equal(t("nav.nowhere"), "nav.nowhere");
  equal(has("nav.nowhere"), false);
});

test("a sentence can stand in another", async () => {
  const { t } = await words("es");
  equal(t("raised", { alert: "alert.lost", robot: "AGI" }), "Alarma: AGI perdido");
});

test("a robot at rest never shows a negative zero", async () => {
  const { number } = await words("es");
  equal(number(-0.0004, 2), "0,00");
  equal(number(Number.NaN, 2), "—");
});

test("markup in a value stays text", async () => {
  const { t } = await words("es");
  const place = document.createElement("div");
  const line = document.createElement("p");
  line.dataset.i18n = "plain";
  line.dataset.slots = JSON.stringify({ a: "<img src=x>", b: "$&" });
  place.append(line);
  translate(place, t);
  equal(line.childElementCount, 0);
  equal(line.textContent, "<img src=x> y $&");
});

test("a lane that iVeg named is named in the reader's words", () => {
  /** @param {string} key @param {Record<string, string>} [slots] */
  const t = (key, slots) => `${key} ${slots?.n}`.trim();
  equal(
    ["Pasillo 1", "12", "Pasillo 3 sur", "Pasillo central", "Cabecera norte"].map(
      (label) => laneName(label, t),
    ),
    [
      "lane.number 1",
      "lane.number 12",
      "lane.number_south 3",
      "lane.central",
      "lane.end_north",
    ],
  );
});

test("a name that a grower gave stays as it is", () => {
  for (const label of ["Tomates de Ana", "Pasillo 1 bis", "pasillo 1", "Lane 4", ""]) {
    equal(
      laneName(label, () => "changed"),
      label,
    );
  }
});

test("13.9 a share below a threshold is never written as the threshold", async () => {
  const loaded = createI18n(async () => ({ share: "{value:percent}" }));
  await loaded.use("en");
  const said = [0.7953, 0.7999, 0.8, 0.29, 1].map((value) =>
    loaded.t("share", { value }),
  );
  equal(said, ["79%", "79%", "80%", "29%", "100%"]);
});

test("13.20 a time is written in minutes as soon as it has any", async () => {
  const loaded = createI18n(async () => ({ age: "{value:span}" }));
  await loaded.use("es");
  const said = [42.4, 222, 7500].map((value) => loaded.t("age", { value }));
  equal(said, ["42 s", "3 min 42 s", "2 h 5 min"]);
});
