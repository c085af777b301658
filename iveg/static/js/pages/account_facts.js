/**
 * Section of the Account page: how somebody came in, and until when they may.
 */

import { need, setHidden, setText } from "../panels/dom.js";
import { dayAndTime } from "./history/local_time.js";

/** @param {import("../core/page.js").Page} page @param {import("../core/api.js").Answer} own */
export function startFacts({ i18n }, { status, body }) {
  function draw() {
    setHidden(need("#account-error"), status === 200);
    if (status !== 200) {
      const said = i18n.t(status ? "rows.failed" : "rows.offline", { status });
      return setText(need("#account-error"), said);
    }
    /** @type {import("../types").OwnAccount} */
    const { method, signed_in_at, ends_at, account } = body;
    setText(need("#account-method"), i18n.t(`accountpage.by.${method}`));
    setText(need("#account-since"), signed_in_at ? dayAndTime(signed_in_at) : "—");
    if (!account) return;
    const ends = ends_at ? dayAndTime(ends_at) : i18n.t("accountpage.never");
    setText(need("#account-ends"), ends);
  }
  i18n.onChange(draw);
  draw();
}
