/**
 * Requests to the server over HTTP: an answer or its status, never an exception.
 *
 * @typedef {{status: number, body: any}} Answer `status` 0: no answer; `body` null
 *   where it was not JSON
 */

/**
 * @param {string} path below `/api/v1/`, or from the root with a leading slash
 * @param {AbortSignal} [signal] ends the question
 * @returns {Promise<Answer>}
 */
export function readApi(path, signal) {
  return ask(path, { headers: { Accept: "application/json" }, signal });
}

/**
 * Sends JSON with the header by which the server tells its own page from others.
 *
 * @param {"POST" | "PUT" | "DELETE"} method
 * @param {string} path
 * @param {unknown} body
 * @returns {Promise<Answer>}
 */
export function sendApi(method, path, body) {
  const headers = {
    Accept: "application/json",
    "Content-Type": "application/json",
    "X-IVEG": "1",
  };
  return ask(path, { method, headers, body: JSON.stringify(body) });
}

/** @param {string} path @param {RequestInit} request @returns {Promise<Answer>} */
async function ask(path, request) {
  const url = path.startsWith("/") ? path : `/api/v1/${path}`;
  try {
    const answer = await fetch(url, { cache: "no-store", ...request });
    const text = await answer.text();
    return { status: answer.status, body: parse(text) };
  } catch {
    return { status: 0, body: null };
  }
}

/** @param {string} text */
function parse(text) {
  try {
    return JSON.parse(text);
  } catch {
    return null;
  }
}
