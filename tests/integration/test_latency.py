"""Where the milliseconds go, on the real stack: a late radio is found, and where."""

from collections.abc import Iterator
from typing import Any

import pytest

from tests.processes import Site, site, until

pytestmark = pytest.mark.timeout(120)
LATE_MS = 400.0


@pytest.fixture
def running(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Site]:
    """The whole stack; AGI's radio is late, AGII's is not."""
    with site(tmp_path_factory.mktemp("latency")) as place:
        place.start("fiware").wait_until_ready()
        place.start("serve")
        place.wait_until_served()
        late = ("--fault", f"AGI:delay_ms={LATE_MS:g}", "--hz", "10")
        place.start("emulator", *late)
        yield place


def p50(told: dict[str, Any], hop: str) -> float:
    rows = {row["data"]: row["hops"] for row in told["rows"]}
    return float(rows["odometry"][hop]["p50_ms"])


def test_a_late_radio_is_found_between_robot_and_broker_within_ten_percent(
    running: Site,
) -> None:
    with running.api() as api:

        def told(robot: str) -> dict[str, Any]:
            query = f"latency?window=1min&figures=false&robot={robot}"
            answer: dict[str, Any] = api.get(query).raise_for_status().json()
            return answer

        def is_measured() -> bool:
            rows = {row["data"]: row["hops"] for row in told("AGI")["rows"]}
            return int(rows["odometry"]["robot_orion"]["count"]) >= 40

        until(is_measured, "AGI's messages are measured")
        late, well = told("AGI"), told("AGII")

    put_in = pytest.approx(LATE_MS, rel=0.10)
    assert p50(late, "uplink") - p50(well, "uplink") == put_in
    assert p50(late, "robot_orion") - p50(well, "robot_orion") == put_in
    assert p50(late, "fiware") < LATE_MS / 4
    assert late["clocks"][0]["state"] == "in_step"
    running.assert_clean()
