/**
 * The Tokens page: programs and what each may, for admins.
 */

import { sendApi } from "../core/api.js";
import { make, need } from "../panels/dom.js";
import { createAges, keepFresh } from "./ages.js";
import { dayAndTime } from "./history/local_time.js";
import { createRows } from "./rows.js";
import { createShownOnce } from "./shown_once.js";
import { makeTwice } from "./twice.js";

/** @typedef {import("../types").ProgramToken} Token */

/** @param {import("../core/page.js").Page} page */
export function start(page) {
  const { i18n } = page;
  const once = createShownOnce(i18n);
  const aged = createAges(page);
  const rows = createRows({ name: "tokens", path: "tokens", i18n, cells });

  /** @param {Token} token */
  function cells({ token_id, name, scope, used_at, ends_at, over }) {
    const ends = ends_at ? dayAndTime(ends_at, { withYear: true }) : "—";
    const label = (/** @type {string} */ key) => i18n.t(`tokenspage.${key}`, { name });
    const change = make("td");
    change.append(
      makeTwice(label("revoke"), label("revoke_sure"), () => revoke(token_id, name)),
    );
    return [
      make("td", "", name),
      make("td", "", i18n.t(`tokenspage.scope.${scope}`)),
      used_at ? aged(used_at) : make("td", "named", i18n.t("tokenspage.never")),
      make("td", "time named", over ? i18n.t("tokenspage.over", { at: ends }) : ends),
      change,
    ];
  }

  /** @param {string} id @param {string} name */
  async function revoke(id, name) {
    const answer = await sendApi("DELETE", `tokens/${id}`, {});
    rows.load();
    if (answer.status !== 204) return once.refuse(answer);
    once.hide();
    return once.say("tokenspage.revoked", { name });
  }

  need("#token-form").addEventListener("submit", async (event) => {
    event.preventDefault();
    const name = fieldOf("#token-name").value.trim();
    const days = fieldOf("#token-days").valueAsNumber || null;
    const scope = fieldOf("#token-scope").value;
    const answer = await sendApi("POST", "tokens", { name, scope, days });
    rows.load();
    if (answer.status !== 201) return once.refuse(answer);
    once.say("tokenspage.given", { name });
    return once.show(answer.body.token);
  });
  keepFresh("tokens", rows.load);
  rows.load();
}

/** @param {string} selector */
const fieldOf = (selector) => /** @type {HTMLInputElement} */ (need(selector));
