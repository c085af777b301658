/**
 * DOM helpers of all panels; text is set as text, never as markup.
 */

const SVG = "http://www.w3.org/2000/svg";

/**
 * @template {keyof HTMLElementTagNameMap} T
 * @param {T} tag
 * @param {string} [className]
 * @param {string} [text]
 * @returns {HTMLElementTagNameMap[T]}
 */
export function make(tag, className, text) {
  const element = document.createElement(tag);
  if (className) element.className = className;
  if (text !== undefined) element.textContent = text;
  return element;
}

/**
 * @param {string} tag
 * @param {Record<string, string | number>} attributes
 * @returns {SVGElement}
 */
export function makeSvg(tag, attributes = {}) {
  const element = document.createElementNS(SVG, tag);
  for (const [name, value] of Object.entries(attributes)) {
    element.setAttribute(name, String(value));
  }
  return element;
}

/**
 * Writes only a different text: most values of most frames are unchanged.
 *
 * A text in place of another keeps its node: a node that comes or goes has the styles of
 * all that depend on what an element has (`:has`) worked out anew.
 *
 * @param {Element} element
 * @param {string} text
 */
export function setText(element, text) {
  const { firstChild: node } = element;
  if (text && node instanceof Text && node.data && !node.nextSibling) {
    if (node.data !== text) node.data = text;
  } else if (element.textContent !== text) element.textContent = text;
}

/** @param {Element} element @param {string} name @param {string} value */
export function setAttribute(element, name, value) {
  if (element.getAttribute(name) !== value) element.setAttribute(name, value);
}

/** @param {HTMLButtonElement} button @param {boolean} disabled */
export function setDisabled(button, disabled) {
  // An attribute that is written is a change, also where it was there before.
  if (button.disabled !== disabled) button.disabled = disabled;
}

/** @param {HTMLElement} element @param {boolean} hidden */
export function setHidden(element, hidden) {
  if (element.hidden !== hidden) element.hidden = hidden;
}

/**
 * One child for each value, made where it is missing, then written anew.
 *
 * @template T
 * @param {Element} place
 * @param {readonly T[]} values
 * @param {() => Element} makeChild
 * @param {(child: Element, value: T) => void} write
 */
export function fill(place, values, makeChild, write) {
  while (place.children.length > values.length) place.lastElementChild?.remove();
  while (place.children.length < values.length) place.append(makeChild());
  values.forEach((value, i) => {
    write(place.children[i], value);
  });
}

/**
 * An element that the page's template must have.
 *
 * @param {string} selector
 * @param {ParentNode} [root]
 * @returns {HTMLElement}
 */
export function need(selector, root = document) {
  const found = root.querySelector(selector);
  if (!found) throw new Error(`the page has no ${selector}`);
  return /** @type {HTMLElement} */ (found);
}

/** @param {string} part @param {ParentNode} root */
export const needPart = (part, root) => need(`[data-part="${part}"]`, root);

/**
 * @param {ParentNode} root
 * @param {string} selector
 * @returns {HTMLElement[]}
 */
export function all(selector, root = document) {
  return [.../** @type {NodeListOf<HTMLElement>} */ (root.querySelectorAll(selector))];
}
