/**
 * The service worker: a page of our own in place of the browser's error when there is no
 * connection, and push messages of the server while no page is open.
 *
 * A fallback for navigation and nothing else: API, live line, sign-in and all requests of
 * an open page go to the network.  Where the browser supports static routes, the worker
 * need not even be awake for them: a STOP waits for nothing.
 */

/** Named by what is in it, so that a change of any part reaches every device. */
const CACHE = "iveg-offline-b62a53ef";
const OFFLINE = "/static/offline.html";
/** What the offline page alone asks for in this way: answered from the cache. */
const OF_OFFLINE = "?offline";
const PARTS = ["css/tokens.css", "css/offline.css", "js/offline.js"];
const NEVER = ["/api/", "/live", "/signin", "/signout", "/ngsi/", "/static/"];
const NOT_NAVIGATIONS = ["cors", "no-cors", "same-origin"];

/** Whether a request may be answered by the offline page. @param {Request} request */
function isFallback({ mode, method, url }) {
  const { origin, pathname, searchParams } = new URL(url);
  return (
    mode === "navigate" &&
    method === "GET" &&
    origin === location.origin &&
    !searchParams.has("token") &&
    !NEVER.some((path) => pathname.startsWith(path))
  );
}

/** Whether a request is for a part of the offline page. @param {Request} request */
function isOfOffline({ url }) {
  const { origin, search } = new URL(url);
  return origin === location.origin && search === OF_OFFLINE;
}

self.ivegIsFallback = isFallback;
self.ivegIsOfOffline = isOfOffline;

self.addEventListener("install", (event) => {
  event.addRoutes?.([
    // The path, too: what is not named is that of this script, and matches nothing.
    {
      condition: { urlPattern: { pathname: "/static/*", search: "offline" } },
      source: "fetch-event",
    },
    ...NOT_NAVIGATIONS.map((requestMode) => ({
      condition: { requestMode },
      source: "network",
    })),
  ]);
  const parts = PARTS.map((part) => `/static/${part}${OF_OFFLINE}`);
  const filled = caches.open(CACHE).then((cache) => cache.addAll([OFFLINE, ...parts]));
  event.waitUntil(filled.then(() => self.skipWaiting()));
});

self.addEventListener("activate", (event) => {
  const tidied = caches.keys().then((names) => {
    const old = names.filter((name) => name !== CACHE);
    return Promise.all(old.map((name) => caches.delete(name)));
  });
  event.waitUntil(tidied);
});

self.addEventListener("fetch", (event) => {
  const { request } = event;
  if (isOfOffline(request)) {
    event.respondWith(caches.match(request).then((kept) => kept ?? fetch(request)));
  } else if (isFallback(request)) {
    event.respondWith(fetch(request).catch(() => caches.match(OFFLINE)));
  }
});
