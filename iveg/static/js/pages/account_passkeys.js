/**
 * Section of the Account page: one's own passkeys, to register and to remove.
 */

import { readApi, sendApi } from "../core/api.js";
import { hasPasskeys, makePasskey } from "../core/passkeys.js";
import { make, need, setHidden, setText } from "../panels/dom.js";
import { askProof, asksForProof } from "../panels/proof.js";
import { dayAndTime } from "./history/local_time.js";
import { makeTwice } from "./twice.js";

/** @typedef {import("../types").PasskeyOfPerson} Passkey */

const PATH = "account/passkeys";
/** @type {Record<number, string>} */
const REFUSED = {
  0: "accountpage.passkeys.cancelled",
  409: "accountpage.passkeys.address",
  422: "accountpage.passkeys.refused",
  429: "signin.wait",
};

/** @param {import("../core/page.js").Page} page */
export function startPasskeys(page) {
  const { i18n } = page;
  const name = /** @type {HTMLInputElement} */ (need("#passkey-name"));
  const note = need("#passkeys-note");
  /** @type {Passkey[]} */
  let own = [];

  async function load() {
    const { status, body } = await readApi(PATH);
    if (status === 200) own = body.items;
    else say("rows.failed", { status });
    draw();
  }

  function draw() {
    need("#passkeys").replaceChildren(...own.map(makeItem));
    setHidden(need("#passkeys-none"), own.length > 0);
  }

  /** @param {Passkey} passkey */
  function makeItem({ passkey_id, name, host, made_at, used_at }) {
    const item = make("li", "line");
    const used = used_at
      ? i18n.t("accountpage.passkeys.used", { at: dayAndTime(used_at) })
      : i18n.t("accountpage.passkeys.unused", { at: dayAndTime(made_at) });
    item.append(
      make("b", "", name),
      make("span", "", `${host} · ${used}`),
      makeTwice(
        i18n.t("accountpage.passkeys.remove"),
        i18n.t("accountpage.passkeys.remove_sure", { name }),
        () => remove(passkey_id, name),
      ),
    );
    return item;
  }

  /** @param {string} id @param {string} name */
  async function remove(id, name) {
    const { status } = await sendApi("DELETE", `${PATH}/${id}`, {});
    say(status === 204 ? "accountpage.passkeys.removed" : "rows.failed", {
      name,
      status,
    });
    await load();
  }

  async function add() {
    const made = await makePasskey(`${PATH}/options`);
    if (asksForProof(made)) return askProof(page, name, add);
    if (made.status !== 200) return refuse(made.status);
    const called = name.value.trim();
    const body = { name: called, passkey: made.body };
    const { status } = await sendApi("POST", PATH, body);
    if (status !== 201) return refuse(status);
    name.value = "";
    say("accountpage.passkeys.added", { name: called });
    return load();
  }

  /** @param {number} status */
  const refuse = (status) => say(REFUSED[status] ?? "rows.failed", { status });

  /** @param {string} key @param {Record<string, string | number>} slots */
  const say = (key, slots) => setText(note, i18n.t(key, slots));

  setHidden(need("#passkey-form"), !hasPasskeys());
  setHidden(need("#passkeys-unable"), hasPasskeys());
  need("#passkey-form").addEventListener("submit", (event) => {
    event.preventDefault();
    add();
  });
  i18n.onChange(draw);
  load();
}
