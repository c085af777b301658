"""An experiment from a real page: started, watched, ended, opened, in es and en."""

import re
from collections.abc import Iterator

import pytest
from playwright.sync_api import expect

from tests.e2e.conftest import OpenPage
from tests.e2e.reading import serious
from tests.processes import Site, site

pytestmark = pytest.mark.e2e


@pytest.fixture(scope="module")
def stack(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Site]:
    """A demo whose robots stay at home."""
    with site(tmp_path_factory.mktemp("iveg")) as place:
        place.start("fiware").wait_until_ready()
        place.start("serve", "--demo")
        place.wait_until_served()
        yield place


def test_an_operator_starts_watches_ends_and_opens_an_experiment(
    open_page: OpenPage,
) -> None:
    page = open_page(route="/latency")
    page.locator("#latency-page a", has_text="Evaluación del artículo").click()
    says, row = page.locator("#experiment-says"), page.locator("#experiments tbody tr")
    expect(says).to_have_text("Ninguno en marcha.")
    expect(page.locator("#experiments-empty")).to_be_visible()

    page.locator("#experiment-start").click()

    expect(says).to_have_text(
        re.compile(
            r"quick-001: 0 de 8 pasadas hechas; ahora demo-field-iveg-1 "
            r"\(reloj virtual\)\. Quedan unos 2:\d\d\."
        )
    )
    expect(row).to_contain_text("En marcha")
    expect(page.locator("#experiment-start")).to_be_disabled()
    expect(page.locator("#experiment-note")).to_contain_text("uno cada vez")
    assert serious(page) == []

    page.locator("#experiment-stop").click()
    page.click('[data-language="en"]')

    expect(row).to_contain_text("Broken off: an operator ended it")
    expect(says).to_have_text("None is running.")
    expect(page.locator("#experiment-start")).to_be_enabled()
    with page.expect_popup() as opened:
        page.locator("#experiments a", has_text="What there is").click()
    report = opened.value
    expect(report.locator("body")).to_contain_text("Broken off: interrupted.")
    heading = report.get_by_role("heading", level=1)
    expect(heading).to_have_text("iVeg experiment: quick")
    report.get_by_role("button", name="Español").click()
    expect(heading).to_have_text("Experimento de iVeg: quick")
    assert serious(report) == []
