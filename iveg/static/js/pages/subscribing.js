/**
 * A subscription of this browser to push messages (Push API).
 */

/** @returns {"ready" | "insecure" | "denied"} */
export function pushState() {
  if (!isSecureContext || !navigator.serviceWorker || !("PushManager" in window)) {
    return "insecure";
  }
  return Notification.permission === "denied" ? "denied" : "ready";
}

/** Asks the person, once. */
export async function mayNotify() {
  return (await Notification.requestPermission()) === "granted";
}

/**
 * @param {string} key this server's public key, base64url
 * @returns {Promise<PushSubscription | null>} null where the browser refuses
 */
export async function subscribe(key) {
  const { pushManager } = await navigator.serviceWorker.ready;
  try {
    return await pushManager.subscribe({
      userVisibleOnly: true,
      applicationServerKey: bytesOf(key),
    });
  } catch {
    return null;
  }
}

/** @param {string} text base64url */
export function bytesOf(text) {
  const plain = text.replaceAll("-", "+").replaceAll("_", "/");
  return Uint8Array.from(atob(plain), (letter) => letter.charCodeAt(0));
}
