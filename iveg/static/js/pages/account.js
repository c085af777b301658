/**
 * The Account page: a module for each section, which starts where its section is.
 */

import { readApi } from "../core/api.js";
import { guarded } from "../core/hub.js";
import { startFacts } from "./account_facts.js";
import { startPassword } from "./account_password.js";
import { startOwnSessions } from "./sessions.js";

/** @typedef {import("../core/page.js").Page} Page */
/** @typedef {import("../core/api.js").Answer} Answer of `GET /account` */

/** @type {[string, (page: Page, own: Answer) => void][]} selector of a section → its start */
const SECTIONS = [
  ["#account-facts", startFacts],
  ["#password-form", startPassword],
  ["#sessions", startOwnSessions],
];

/** @param {Page} page */
export async function start(page) {
  const own = await readApi("account");
  for (const [selector, begin] of SECTIONS)
    if (document.querySelector(selector)) guarded(() => begin(page, own));
}
