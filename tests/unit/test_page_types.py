"""The page's types are those of the models, and name what the server sends."""

import pytest

from iveg.models.typescript import WRITTEN
from tests.processes import ROOT


@pytest.mark.parametrize("name", WRITTEN)
def test_what_the_page_has_from_python_is_fresh(name: str) -> None:
    stale = f"iveg/static/js/{name}: python -m iveg.models.typescript"

    assert (ROOT / "iveg/static/js" / name).read_text() == WRITTEN[name](), stale
