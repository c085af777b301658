/**
 * Notifications outside of the page: three forms, each saved and tried by itself.
 *
 * Secrets of the server are never here: an empty password or address keeps the stored
 * one.
 *
 * @typedef {import("../types").Messages} Messages
 * @typedef {"push" | "email" | "webhook"} Channel
 * @typedef {import("../core/api.js").Answer} Answer
 */

import { readApi, sendApi } from "../core/api.js";
import { make, need, setHidden, setText } from "../panels/dom.js";
import { toldSaid } from "../panels/told.js";
import { mayNotify, pushState, subscribe } from "./subscribing.js";

const READERS = new Set(["operator", "admin"]);
/** @type {Channel[]} */
const CHANNELS = ["push", "email", "webhook"];

/** @param {string} id */
const input = (id) => /** @type {HTMLInputElement} */ (need(`#${id}`));

/** @param {import("../core/i18n.js").I18n} i18n */
export function createMessagesForm(i18n) {
  /** @type {Messages | null} */
  let known = null;
  /** The values of a channel's fields when they were filled. */
  const filled = new Map();

  async function load() {
    if (!READERS.has(document.body.dataset.role ?? "")) {
      return setText(need("#messages-note"), i18n.t("messages.role"));
    }
    const { status, body } = await readApi("messages");
    if (status !== 200) {
      const key = status ? "rows.failed" : "rows.offline";
      return setText(need("#messages-note"), i18n.t(key, { status }));
    }
    setHidden(need("#messages-note"), true);
    setHidden(need("#channels"), false);
    known = body;
    CHANNELS.forEach(fill);
    return draw();
  }

  /** @param {Channel} channel */
  function fill(channel) {
    if (known) FILL[channel](known);
    filled.set(channel, held(channel));
  }

  function draw() {
    if (!known) return;
    for (const channel of CHANNELS) {
      const { last } = known[channel];
      const told = toldSaid(last, i18n);
      setText(
        need(`#${channel}-last`),
        last.length ? i18n.t("messages.last", { told }) : "",
      );
    }
    const kept = i18n.t("messages.kept");
    input("email-password").placeholder = known.email.has_password ? kept : "";
    const { host } = known.webhook;
    input("webhook-url").placeholder = host ? `${host}: ${kept}` : "";
    drawDevices(known, i18n, remove);
  }

  /** @param {Channel} channel @param {string} key @param {object} [slots] */
  function say(channel, key, slots) {
    setText(need(`#${channel}-result`), i18n.t(key, /** @type {any} */ (slots)));
  }

  /** @param {Channel} channel @param {Answer} answer */
  function take(channel, { status, body }) {
    if (status === 200) {
      known = body;
      fill(channel);
      say(channel, "messages.saved");
    } else if (status === 0) say(channel, "rows.offline");
    else say(channel, "messages.refused", { why: whyOf(body) ?? status });
    draw();
  }

  /** @param {Channel} channel */
  async function test(channel) {
    say(channel, "messages.testing");
    const { status, body } = await sendApi("POST", `messages/${channel}/test`, {});
    if (status === 200) setText(need(`#${channel}-result`), toldSaid(body.told, i18n));
    else if (status === 0) say(channel, "rows.offline");
    else say(channel, "messages.test_refused", { why: whyOf(body) ?? status });
  }

  /** One tap: switches push on where nobody has, and tells this browser. */
  async function join() {
    const state = pushState();
    if (state !== "ready") return say("push", `messages.push.${state}`);
    // Some browsers ask only while the tap lasts, so before the server is asked.
    if (!(await mayNotify())) return say("push", "messages.push.denied");
    if (!known?.push.on || !known.push.public_key) {
      const contact = known?.push.contact ?? "";
      take("push", await sendApi("PUT", "messages/push", { on: true, contact }));
    }
    if (!known?.push.on || !known.push.public_key) return undefined;
    const subscription = await subscribe(known.push.public_key);
    if (!subscription) return say("push", "messages.push.denied");
    const { endpoint, keys } = subscription.toJSON();
    const who = input("push-who").value.trim() || navigator.platform || "—";
    const body = { who, endpoint, keys, language: i18n.language() };
    take("push", await sendApi("POST", "messages/devices", body));
    const isApple = new URL(String(endpoint)).host.endsWith(".push.apple.com");
    if (isApple && !known.push.contact) say("push", "messages.push.apple");
    return undefined;
  }

  /** @param {string} id */
  async function remove(id) {
    const path = `messages/devices/${encodeURIComponent(id)}`;
    take("push", await sendApi("DELETE", path, {}));
  }

  for (const channel of CHANNELS) {
    need(`#${channel}-form`).addEventListener("submit", async (event) => {
      event.preventDefault();
      take(channel, await sendApi("PUT", `messages/${channel}`, READ[channel]()));
    });
    need(`#${channel}-test`).addEventListener("click", () => test(channel));
  }
  need("#push-join").addEventListener("click", join);
  i18n.onChange(draw);
  load();
  return {
    isDirty: () =>
      known !== null && CHANNELS.some((name) => filled.get(name) !== held(name)),
  };
}

/** What is typed into the fields of a channel. @param {Channel} channel */
function held(channel) {
  return JSON.stringify(READ[channel]());
}

/** @param {any} body */
function whyOf(body) {
  const [first] = body?.errors ?? [];
  return first ? `${first.where}: ${first.what}` : body?.detail;
}

/** @type {Record<Channel, (all: Messages) => void>} */
const FILL = {
  push({ push }) {
    input("push-on").checked = push.on;
    input("push-contact").value = push.contact;
  },
  email({ email }) {
    input("email-on").checked = email.on;
    for (const name of ["server", "user", "sender", "security", "least", "language"]) {
      input(`email-${name}`).value = String(/** @type {any} */ (email)[name]);
    }
    input("email-port").value = String(email.port);
    input("email-password").value = "";
    input("email-recipients").value = email.recipients
      .map(({ who, address }) => `${who} ${address}`)
      .join("\n");
  },
  webhook({ webhook }) {
    input("webhook-on").checked = webhook.on;
    input("webhook-who").value = webhook.who;
    input("webhook-least").value = webhook.least;
    input("webhook-url").value = "";
  },
};

/** @type {Record<Channel, () => object>} */
const READ = {
  push: () => ({
    on: input("push-on").checked,
    contact: input("push-contact").value.trim(),
  }),
  email: () => ({
    on: input("email-on").checked,
    server: input("email-server").value.trim(),
    port: Number(input("email-port").value),
    security: input("email-security").value,
    user: input("email-user").value.trim(),
    password: input("email-password").value || null,
    sender: input("email-sender").value.trim(),
    recipients: recipientsIn(input("email-recipients").value),
    least: input("email-least").value,
    language: input("email-language").value,
  }),
  webhook: () => ({
    on: input("webhook-on").checked,
    who: input("webhook-who").value.trim(),
    url: input("webhook-url").value.trim() || null,
    least: input("webhook-least").value,
  }),
};

/**
 * One recipient a line: a name, then an address; an address alone is its own name.
 *
 * @param {string} text
 */
export function recipientsIn(text) {
  const lines = text.split("\n").map((line) => line.trim());
  return lines.filter(Boolean).map((line) => {
    const parts = line.split(/[\s,;<>]+/).filter(Boolean);
    const address = parts.pop() ?? "";
    return { who: parts.join(" ") || address.split("@")[0], address };
  });
}

/**
 * @param {Messages} known
 * @param {import("../core/i18n.js").I18n} i18n
 * @param {(id: string) => void} remove
 */
function drawDevices({ push }, i18n, remove) {
  const list = need("#push-devices");
  const items = push.devices.map(({ device_id, who }) => {
    const item = make("li");
    const button = make("button", "button", i18n.t("messages.push.leave", { who }));
    button.type = "button";
    button.addEventListener("click", () => remove(device_id));
    item.append(button);
    return item;
  });
  list.replaceChildren(
    ...(items.length ? items : [make("li", "", i18n.t("messages.push.none"))]),
  );
}
