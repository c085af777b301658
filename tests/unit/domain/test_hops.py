"""One table of hops for all who judge them."""

import pytest

from iveg.domain.probe import Hop
from iveg.vital.health_monitor import HealthMonitor
from iveg.web.pages.sentences import LANGUAGES, read_sentences
from tests.builders import at


def test_the_running_monitor_judges_hops_in_the_order_of_the_table() -> None:
    judged = [hop.name for hop in HealthMonitor(at(0.0), lambda: "ok").hops(at(1.0))]

    assert judged == [hop for hop in Hop if hop is not Hop.PAGE]


@pytest.mark.parametrize("language", LANGUAGES)
def test_every_hop_has_a_name_in_the_readers_language(language: str) -> None:
    known = read_sentences(language).sentences

    assert [hop for hop in Hop if hop.label not in known] == []
