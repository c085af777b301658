"""Another server that robots hear is an alert, and a restart of this one is none."""

from dataclasses import replace

import pytest

from iveg.domain.observations import FeedbackRef
from tests.builders import odometry
from tests.unit.vital.desk import Desk


@pytest.mark.parametrize(
    ("rises", "named"), [(True, ["other"]), (False, [])], ids=["speaks on", "is past"]
)
async def test_a_boot_that_robots_go_on_hearing_is_a_p1_with_its_name(
    rises: bool, named: list[str]
) -> None:
    desk = Desk(("AGI",))
    for step in range(40):
        said = replace(desk.next_origin(), acknowledgements=True)
        heard = FeedbackRef("other", step if rises else 900)
        desk.hear(odometry("AGI", origin=replace(said, heard=heard)))
        await desk.wait(0.1)

    found = [one.condition for one in desk.evaluator.alerts.waiting]

    told = [one for one in found if one.key == "alert.another_iveg"]
    assert [one.slots["boot"] for one in told] == named
    assert {one.priority for one in told} <= {"P1"}
