import { createI18n } from "../../iveg/static/js/core/i18n.js";
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

test("13.9 a share below a threshold is never written as the threshold", async () => {
  const loaded = createI18n(async () => ({ share: "{value:percent}" }));
  await loaded.use("en");
  const said = [0.7953, 0.7999, 0.8, 0.29, 1].map((value) =>
    loaded.t("share", { value }),
  );
  equal(said, ["79%", "79%", "80%", "29%", "100%"]);
});
