/**
 * A button that asks before it acts: the second press does it, whatever takes the focus
 * away takes the question back.
 */

import { make, setText } from "../panels/dom.js";

/**
 * @param {string} label what it does
 * @param {string} question what its second press does
 * @param {() => void} act
 */
export function makeTwice(label, question, act) {
  const button = make("button", "button", label);
  button.type = "button";
  let isAsked = false;
  /** @param {boolean} asked */
  function turn(asked) {
    isAsked = asked;
    setText(button, asked ? question : label);
  }
  button.addEventListener("click", () => {
    if (isAsked) act();
    turn(!isAsked);
  });
  button.addEventListener("blur", () => turn(false));
  return button;
}
