"""Pages that draw slowly do so, and call each callback once, in order."""

import pytest
from playwright.sync_api import Browser

from tests.e2e.reading import evaluate
from tests.e2e.slowly import PICTURES_HZ, draw_slowly

pytestmark = pytest.mark.e2e

_FIVE_GAPS = """() => new Promise((resolve) => {
  let began;
  let left = 6;
  const draw = () => {
    began ??= performance.now();
    left -= 1;
    if (left) requestAnimationFrame(draw);
    else resolve(performance.now() - began);
  };
  requestAnimationFrame(draw);
})"""

_ORDER = """() => new Promise((resolve) => {
  const told = [];
  requestAnimationFrame(() => told.push('first'));
  const never = requestAnimationFrame(() => told.push('cancelled'));
  requestAnimationFrame((now) => {
    told.push(typeof now);
    requestAnimationFrame(() => resolve(told));
  });
  cancelAnimationFrame(never);
})"""


def test_a_page_that_draws_slowly_draws_ten_times_a_second_in_order(
    browser: Browser,
) -> None:
    with browser.new_context() as context:
        draw_slowly(context)
        page = context.new_page()
        # What a new page shows first is older than the script.
        page.goto("data:text/html,<p>a page")

        took_ms = evaluate(page, _FIVE_GAPS)
        told = evaluate(page, _ORDER)

    assert took_ms > 5 * 1000 / PICTURES_HZ - 1
    assert told == ["first", "number"]
