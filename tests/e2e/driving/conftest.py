"""One stack for tests that break nothing: whatever they stop drives again."""

from collections.abc import Iterator

import pytest

from tests.e2e.conftest import driving_site
from tests.processes import Site


@pytest.fixture(scope="package")
def stack(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Site]:
    """FIWARE, dashboard and emulator, driving; shared by all modules of this folder."""
    with driving_site(tmp_path_factory.mktemp("driving")) as place:
        yield place
