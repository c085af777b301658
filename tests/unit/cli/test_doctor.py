import pytest

from iveg.cli.doctor import Finding, write_line
from iveg.domain.probe import Hop


@pytest.mark.parametrize("hop", Hop)
def test_a_hop_is_one_line_and_a_failed_one_says_why_and_what_to_do(hop: Hop) -> None:
    line = write_line(hop, {hop: Finding(False, "Connection refused")})

    assert line.split()[:2] == [hop, "failed"]
    assert "Connection refused; look " in line
    assert "\n" not in line
    assert write_line(hop, {hop: Finding(True)}).split() == [hop, "ok"]


def test_a_hop_behind_a_failed_one_is_not_tried() -> None:
    line = write_line(Hop.AGENT, {Hop.ORION: Finding(False, "down")})

    assert line.endswith("not tried  repair the failed hops first")
