"""Which hop is broken is known by what went through it."""

import pytest

from iveg.pipeline.chain import Chain
from tests.builders import START, at


def states(chain: Chain, now: float) -> dict[str, str]:
    return {hop.name: hop.state for hop in chain.hops(at(now))}


def healthy(now: float) -> Chain:
    chain = Chain(START)
    chain.mqtt_connected = True
    chain.orion_ok_at = chain.canary_at = chain.notified_at = at(now).mono
    chain.database = "ok"
    return chain


def test_nobody_is_accused_in_the_first_seconds() -> None:
    found = states(Chain(START), 5.9)

    assert found == {
        "mqtt": "unknown",
        "iot_agent": "unknown",
        "orion": "unknown",
        "notifications": "unknown",
        "database": "unknown",
    }


def test_a_whole_chain_is_ok() -> None:
    assert set(states(healthy(10.0), 10.0).values()) == {"ok"}


@pytest.mark.parametrize(
    ("age", "state"), [(4.0, "ok"), (4.1, "late"), (5.5, "late"), (5.6, "down")]
)
def test_f4_an_agent_that_is_deaf_is_found_by_the_canary(
    age: float, state: str
) -> None:
    chain = healthy(10.0)
    chain.notified_at = at(10.0 + age).mono

    assert states(chain, 10.0 + age)["iot_agent"] == state


def test_f3_an_agent_that_does_not_answer_is_down_at_once() -> None:
    chain = healthy(10.0)
    chain.agent_error = "cannot be reached"

    assert states(chain, 10.0)["iot_agent"] == "down"


def test_f6_while_orion_is_down_nobody_behind_it_is_accused() -> None:
    chain = healthy(10.0)
    chain.orion_error = "500"

    found = states(chain, 20.0)

    assert found["orion"] == "down"
    assert (found["iot_agent"], found["notifications"]) == ("unknown", "unknown")


def test_f1_while_the_broker_is_away_the_agent_is_not_accused() -> None:
    chain = healthy(10.0)
    chain.mqtt_connected = False

    assert states(chain, 20.0)["iot_agent"] == "unknown"


def test_f8_notifications_that_stopped_are_found_while_orion_answers() -> None:
    chain = healthy(10.0)
    chain.orion_ok_at = at(20.0).mono

    found = states(chain, 20.0)

    assert (found["orion"], found["notifications"]) == ("ok", "down")


def test_what_never_came_is_down_after_the_first_seconds() -> None:
    assert states(Chain(START), 6.1)["notifications"] == "down"
