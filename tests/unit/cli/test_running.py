"""The address that ``iveg`` prints for people."""

import pytest

from iveg.cli.running import reachable_host


@pytest.mark.parametrize("every", ["0.0.0.0", "::"])  # noqa: S104 - nobody listens
def test_a_server_at_every_address_is_named_by_one_that_leads_there(every: str) -> None:
    assert reachable_host(every) not in (every, "")
