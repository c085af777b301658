/**
 * The installed page without a connection: one sentence in place of the browser's error;
 * and what the server has people told while no page is open.
 *
 * Navigation fallback and nothing else: API, live line, sign-in and whatever an open page
 * asks for go to the network as if this were not here.  Where the browser can be told so
 * beforehand, this need not even be awake for them: a STOP waits for nobody.
 */

const CACHE = "iveg-offline-1";
const OFFLINE = "/static/offline.html";
const NEVER = ["/api/", "/live", "/signin", "/signout", "/ngsi/", "/static/", "/docs"];
const NOT_NAVIGATIONS = ["cors", "no-cors", "same-origin"];

/** Whether a request may be answered by the sentence. @param {Request} request */
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

/** A page that is open comes forward as it is: somebody may be at its STOP. */
async function openAlerts() {
  const pages = await self.clients.matchAll({ type: "window" });
  return pages.length ? pages[0].focus() : self.clients.openWindow("/alerts");
}
