"""What the documents promise is what the code has."""

import pytest

from iveg import settings
from tests.architecture import documents, sensor_pages
from tests.processes import ROOT


def test_the_settings_page_is_the_table_of_settings() -> None:
    assert (ROOT / "docs/settings.md").read_text() == settings.describe()


@pytest.mark.parametrize("name", sensor_pages.PAGES)
def test_what_a_page_says_of_small_sensors_is_fresh(name: str) -> None:
    page = (documents.INTERFACES / name).read_text()

    stale = f"docs/interfaces/{name}: python -m tests.architecture.sensor_pages"
    assert page == sensor_pages.PAGES[name](page), stale
