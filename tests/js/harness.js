/**
 * A page of tests: each has the name of the fact it proves, and fails by throwing.
 *
 * @typedef {{name: string, error: string | null}} Result
 */

/** @type {{name: string, body: () => void | Promise<void>}[]} */
const tests = [];

/** @param {string} name @param {() => void | Promise<void>} body */
export function test(name, body) {
  tests.push({ name, body });
}

/** @returns {Promise<Result[]>} */
export async function run() {
  const results = [];
  for (const { name, body } of tests)
    results.push({ name, error: await failureOf(body) });
  return results;
}

/**
 * Compares by what JSON and numbers show; floats exactly.
 *
 * @param {unknown} found
 * @param {unknown} wanted
 */
export function equal(found, wanted) {
  if (show(found) === show(wanted)) return;
  throw new Error(`found ${show(found)}, wanted ${show(wanted)}`);
}

/** @param {number} found @param {number} wanted @param {number} [within] */
export function near(found, wanted, within = 1e-9) {
  if (Math.abs(found - wanted) <= within) return;
  throw new Error(`found ${found}, wanted ${wanted} ± ${within}`);
}

/** @param {() => unknown} body @param {new (...facts: any[]) => Error} kind */
export function throws(body, kind) {
  try {
    body();
  } catch (error) {
    if (error instanceof kind) return;
    throw error;
  }
  throw new Error(`nothing thrown, wanted ${kind.name}`);
}

/** @param {() => boolean} isSo within two seconds */
export async function until(isSo) {
  const deadline = performance.now() + 2000;
  while (!isSo()) {
    if (performance.now() > deadline) throw new Error("it never came true");
    await new Promise((done) => setTimeout(done, 1));
  }
}

/** @param {() => void | Promise<void>} body */
async function failureOf(body) {
  try {
    await body();
    return null;
  } catch (error) {
    return error instanceof Error ? (error.stack ?? error.message) : String(error);
  }
}

/** @param {unknown} value */
function show(value) {
  if (typeof value === "number") return String(value);
  return JSON.stringify(value, (_, it) =>
    typeof it === "number" && !Number.isFinite(it) ? String(it) : it,
  );
}
