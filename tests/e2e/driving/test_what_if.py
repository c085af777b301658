"""Another rule in a browser: asked about, tried, put in force; and ranges as text."""

import re

import pytest
from playwright.sync_api import Page, expect

from tests.e2e.conftest import OpenPage
from tests.processes import Site, until

pytestmark = pytest.mark.e2e

OVER = re.compile("Calculado|nada de este|No se ha podido")


def is_answered(page: Page) -> bool:
    """Ask; whether there is an answer: at first there are no rows yet."""
    with page.expect_response("**/api/v1/what-if"):
        page.locator("#whatif-ask").click()
    expect(page.locator("#whatif-result")).to_have_text(OVER)
    return page.locator("#whatif-answer").is_visible()


def radius_of(page: Page) -> float:
    """That of the rule in force, as the form begins (m)."""
    expect(page.locator("#whatif-radius_m")).not_to_have_value("")
    return float(page.locator("#whatif-radius_m").input_value())


def test_a_question_is_answered_by_a_curve_with_the_rule_in_force_marked(
    open_page: OpenPage,
) -> None:
    page = open_page(route="/what-if")
    in_force = radius_of(page)
    page.locator("#whatif-radius_m").fill(str(in_force + 1))
    page.locator("#whatif-hours").select_option("1")
    page.locator("#whatif-vary").select_option("radius_m")

    until(lambda: is_answered(page), "there is an answer")

    expect(page.locator("#whatif-rows tr")).to_have_count(6)
    marked = page.locator("#whatif-minutes .shapelayer path")
    expect(marked).to_have_count(1)
    figure = page.evaluate(
        """() => {
            const {data, layout} = document.querySelector("#whatif-minutes");
            return [data[0].x, layout.shapes[0].x0];
        }"""
    )
    assert {0.5, 2, 6, in_force, in_force + 1} <= {*figure[0]}
    assert figure[1] == in_force
    # Nobody knows the truth here.
    expect(page.locator("#whatif-truth-section")).to_be_hidden()


def test_what_is_wrong_in_a_folded_field_is_shown(open_page: OpenPage) -> None:
    page = open_page(route="/what-if")
    radius_of(page)
    field = page.locator("#whatif-release_beyond_m")
    expect(field).to_be_hidden()
    field.evaluate("field => { field.value = '99'; }")

    page.locator("#whatif-ask").click()

    expect(field).to_be_visible()
    expect(field).to_be_focused()
    expect(page.locator("#whatif-progress")).to_be_hidden()


def test_a_question_tells_its_progress_and_is_ended(open_page: OpenPage) -> None:
    page = open_page(route="/what-if")
    expect(page.locator("#whatif-radius_m")).not_to_have_value("")
    page.locator("#whatif-hours").select_option("168")

    page.locator("#whatif-ask").click()
    expect(page.locator("#whatif-progress")).to_be_visible()
    page.locator("#whatif-cancel").click()

    expect(page.locator("#whatif-result")).to_have_text("Detenido.")
    expect(page.locator("#whatif-cancel")).to_be_hidden()
    expect(page.locator("#whatif-answer")).to_be_hidden()


def test_a_trial_is_begun_shown_and_put_in_force(
    open_page: OpenPage, stack: Site
) -> None:
    page = open_page(route="/what-if")
    wanted = radius_of(page) + 1
    page.locator("#whatif-radius_m").fill(str(wanted))
    page.locator("#trial-begin").click()
    expect(page.locator("#trial-found")).to_be_visible()
    # More is protected, so nothing is asked again.
    expect(page.locator("#trial-sums")).not_to_be_empty()

    page.locator("#trial-promote").click()

    expect(page.locator("#trial-begin")).to_be_visible()
    with stack.api() as api:
        rule = api.get("rule").json()
    assert rule["radius_m"] == wanted
    assert rule["comparison"]["compared_s"] > 0.0


def test_ranges_are_typed_in_the_page_s_words_and_refused_in_them(
    open_page: OpenPage,
) -> None:
    page = open_page(route="/compare", locale="en-US")
    # Before the page's own code has come the server refuses, in a page of its own.
    page.wait_for_load_state("networkidle")
    since = page.locator("[name=than_since]")
    assert since.get_attribute("type") in (None, "text")
    shown = since.input_value()
    assert re.fullmatch(r"\d{4}-\d\d-\d\d \d\d:\d\d:\d\d", shown)

    since.fill("20/11/2026 9:00")
    since.press("Enter")
    expect(page.locator("#compare-error")).to_contain_text("2026-11-20 09:00")
    expect(since).to_be_focused()
    expect(since).to_have_attribute("aria-invalid", "true")

    since.fill(shown[:16])
    since.press("Enter")
    page.wait_for_url("**/compare?**")
    expect(page.locator("[name=than_since]")).to_have_value(shown[:16] + ":00")
