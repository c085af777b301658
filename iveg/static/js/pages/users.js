/**
 * The Users page: accounts of people, for admins.
 */

import { sendApi } from "../core/api.js";
import { make, need } from "../panels/dom.js";
import { dayAndTime } from "./history/local_time.js";
import { createRows } from "./rows.js";
import { createShownOnce } from "./shown_once.js";
import { makeTwice } from "./twice.js";

/** @typedef {import("../core/i18n.js").I18n} I18n */
/** @typedef {import("../types").UserAccount} User */
/** @typedef {(user: User, path: string, method: "POST" | "PUT", body: object) => void} Change */

const ROLES = /** @type {const} */ (["viewer", "operator", "admin"]);

/** @param {import("../core/page.js").Page} page */
export function start({ i18n }) {
  const once = createShownOnce(i18n);
  const rows = createRows({
    name: "users",
    path: "users",
    i18n,
    cells: (user) => cellsOf(user, i18n, change),
  });

  /** @type {Change} */
  async function change({ user_id, name }, path, method, body) {
    take(await sendApi(method, `users/${user_id}/${path}`, body), name);
  }

  /** @param {import("../core/api.js").Answer} answer @param {string} name */
  function take(answer, name) {
    const { status, body } = answer;
    rows.load();
    if (status !== 200 && status !== 201) return once.refuse(answer);
    once.hide();
    if (!body.code) return once.say("userspage.changed", { name });
    const until = dayAndTime(body.user.invited_until);
    once.say("userspage.given", { name, until });
    return once.show(body.code.link, body.code.image);
  }

  need("#invite-form").addEventListener("submit", async (event) => {
    event.preventDefault();
    const name = fieldOf("#invite-name").value.trim();
    const days = fieldOf("#invite-days").valueAsNumber || null;
    const role = fieldOf("#invite-role").value;
    take(await sendApi("POST", "users", { name, role, days }), name);
  });
  rows.load();
}

/** @param {string} selector */
const fieldOf = (selector) => /** @type {HTMLInputElement} */ (need(selector));

/** @param {User} user @param {I18n} i18n @param {Change} change */
function cellsOf(user, i18n, change) {
  const { name, role, state, ends_at, invited_until } = user;
  const ends = { active: ends_at, invited: invited_until, over: ends_at };
  const at = ends[/** @type {keyof typeof ends} */ (state)];
  const ending = state === "active" && at ? "ending" : state;
  const said = i18n.t(`userspage.state.${ending}`);
  const given = user.provided ? ` · ${i18n.t("userspage.provided")}` : "";
  return [
    make("td", "", name),
    make("td", "", `${i18n.t(`header.role.${role}`)}${given}`),
    make("td", "", at ? `${said} ${dayAndTime(at)}` : said),
    user.own ? make("td", "", i18n.t("userspage.own")) : changesOf(user, i18n, change),
  ];
}

/** @param {User} user @param {I18n} i18n @param {Change} change */
function changesOf(user, i18n, change) {
  const { name } = user;
  const label = (/** @type {string} */ key) => i18n.t(`userspage.${key}`, { name });
  const line = make("div", "line");
  if (!user.provided) line.append(...rolesOf(user, i18n, change));
  if (!user.provided || user.state === "disabled") {
    const reset = user.provided ? "let_in" : "reset";
    line.append(
      makeTwice(label(reset), label(`${reset}_sure`), () =>
        change(user, "reset", "POST", {}),
      ),
    );
  }
  if (user.state !== "disabled")
    line.append(
      makeTwice(label("disable"), label("disable_sure"), () =>
        change(user, "disable", "POST", {}),
      ),
    );
  const cell = make("td");
  cell.append(line);
  return cell;
}

/** @param {User} user @param {I18n} i18n @param {Change} change */
function rolesOf(user, i18n, change) {
  const { name } = user;
  const label = (/** @type {string} */ key) => i18n.t(`userspage.${key}`, { name });
  const role = make("select");
  role.setAttribute("aria-label", label("role_of"));
  for (const one of ROLES) {
    const option = make("option", "", i18n.t(`header.role.${one}`));
    option.value = one;
    option.selected = one === user.role;
    role.append(option);
  }
  const give = makeTwice(label("give_role"), label("give_role_sure"), () =>
    change(user, "role", "PUT", { role: role.value }),
  );
  return [role, give];
}
