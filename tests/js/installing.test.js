import { recipientsIn } from "../../iveg/static/js/pages/messages.js";
import { bytesOf } from "../../iveg/static/js/pages/subscribing.js";
import { equal, test } from "./harness.js";

test("13.23: the offline sentence never stands for API, live line or sign-in", async () => {
  await import(/** @type {any} */ ("../../iveg/static/sw.js"));
  const isFallback = /** @type {any} */ (self).ivegIsFallback;
  const asked = (/** @type {string} */ path, mode = "navigate", method = "GET") =>
    isFallback({ mode, method, url: new URL(path, location.href).href });
  equal(
    ["/", "/alerts", "/decisions/D1"].map((path) => asked(path)),
    [true, true, true],
  );
  const never = ["/api/v1/robots", "/live", "/signin", "/?token=ab", "/static/x"];
  equal(
    never.map((path) => asked(path)),
    never.map(() => false),
  );
  equal([asked("/", "cors"), asked("/", "navigate", "POST")], [false, false]);
  const isPart = /** @type {any} */ (self).ivegIsOfOffline;
  const parts = ["/static/css/tokens.css", "/static/css/tokens.css?offline", "/live"];
  equal(
    parts.map((path) => isPart({ url: new URL(path, location.href).href })),
    [false, true, false],
  );
});

test("13.23: recipients are typed as people write them, one a line", () => {
  equal(recipientsIn("Ana María ana@coop.es\n\n Eva <eva@coop.es>\njo@coop.es"), [
    { who: "Ana María", address: "ana@coop.es" },
    { who: "Eva", address: "eva@coop.es" },
    { who: "jo", address: "jo@coop.es" },
  ]);
});

test("13.23: the server's key is read as a browser wants it", () => {
  equal([...bytesOf("_-8B")], [255, 239, 1]);
});

test("13.23: a push is shown by its own words, and leads to the alarms", async () => {
  const shown = /** @type {unknown[]} */ ([]);
  const worker = /** @type {any} */ (globalThis);
  worker.registration = {
    showNotification: async (/** @type {unknown[]} */ ...told) => shown.push(told[0]),
  };
  worker.clients = {
    matchAll: async () => [],
    openWindow: async (/** @type {string} */ path) => shown.push(path),
  };
  const done = /** @type {Promise<unknown>[]} */ ([]);
  const fire = (/** @type {string} */ kind, /** @type {object} */ facts) => {
    const waitUntil = (/** @type {Promise<unknown>} */ work) => done.push(work);
    dispatchEvent(Object.assign(new Event(kind), { waitUntil, ...facts }));
  };
  fire("push", { data: { json: () => ({ title: "iVeg: alarma P1", body: "…" }) } });
  fire("notificationclick", { notification: { close: () => undefined } });
  await Promise.all(done);
  equal(shown, ["iVeg: alarma P1", "/alerts"]);
});
