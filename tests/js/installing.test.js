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
