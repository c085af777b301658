/**
 * The service worker: one sentence in place of the browser's error when there is no
 * connection, and push messages of the server while no page is open.
 *
 * A fallback for navigation and nothing else: API, live line, sign-in and all requests of
 * an open page go to the network.  Where the browser supports static routes, the worker
 * need not even be awake for them: a STOP waits for nothing.
 */

const CACHE = "iveg-offline-1";
const OFFLINE = "/static/offline.html";
const NEVER = ["/api/", "/live", "/signin", "/signout", "/ngsi/", "/static/", "/docs"];
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

self.ivegIsFallback = isFallback;

self.addEventListener("install", (event) => {
  event.addRoutes?.(
    NOT_NAVIGATIONS.map((requestMode) => ({
      condition: { requestMode },
      source: "network",
    })),
  );
  const filled = caches.open(CACHE).then((cache) => cache.add(OFFLINE));
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
  if (!isFallback(event.request)) return;
  event.respondWith(fetch(event.request).catch(() => caches.match(OFFLINE)));
});

self.addEventListener("push", (event) => {
  const { title = "iVeg", body = "" } = event.data?.json() ?? {};
  event.waitUntil(
    self.registration.showNotification(title, {
      body,
      icon: "/static/icons/192.png",
      requireInteraction: true,
    }),
  );
});

self.addEventListener("notificationclick", (event) => {
  event.notification.close();
  event.waitUntil(openAlerts());
});

/** An open page comes to the front as it is: a person may be at its STOP. */
async function openAlerts() {
  const pages = await self.clients.matchAll({ type: "window" });
  return pages.length ? pages[0].focus() : self.clients.openWindow("/alerts");
}
