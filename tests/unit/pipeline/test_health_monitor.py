"""Which hop is broken is known by what went through it."""

import pytest

from iveg.domain.hops import Hop
from iveg.domain.observations import Origin
from iveg.pipeline.health_monitor import HealthMonitor, HopHealth, Pace
from tests.builders import START, at


def states(health_monitor: HealthMonitor, now: float) -> dict[str, str]:
    return {hop.name: hop.state for hop in health_monitor.hops(at(now))}


def hop(health_monitor: HealthMonitor, name: str, now: float) -> HopHealth:
    return next(one for one in health_monitor.hops(at(now)) if one.name == name)


def healthy(now: float) -> HealthMonitor:
    health_monitor = HealthMonitor(START, lambda: "ok")
    health_monitor.mqtt_connected = True
    health_monitor.orion_ok_at = health_monitor.received_at = (
        health_monitor.notified_at
    ) = at(now).mono
    return health_monitor


def test_nobody_is_accused_in_the_first_seconds() -> None:
    found = states(HealthMonitor(START), 5.9)

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
def test_f4_an_agent_that_is_deaf_is_found_by_the_probe(age: float, state: str) -> None:
    health_monitor = healthy(10.0)
    health_monitor.notified_at = at(10.0 + age).mono

    assert states(health_monitor, 10.0 + age)["iot_agent"] == state


def test_f3_an_agent_that_does_not_answer_is_down_at_once() -> None:
    health_monitor = healthy(10.0)
    health_monitor.agent_error = "cannot be reached"

    assert states(health_monitor, 10.0)["iot_agent"] == "down"


def test_f6_while_orion_is_down_nobody_behind_it_is_accused() -> None:
    health_monitor = healthy(10.0)
    health_monitor.orion_error = "500"

    found = states(health_monitor, 20.0)

    assert found["orion"] == "down"
    assert (found["iot_agent"], found["notifications"]) == ("unknown", "unknown")


def test_f1_while_the_broker_is_away_the_agent_is_not_accused() -> None:
    health_monitor = healthy(10.0)
    health_monitor.mqtt_connected = False

    assert states(health_monitor, 20.0)["iot_agent"] == "unknown"


def test_f8_notifications_that_stopped_are_found_while_orion_answers() -> None:
    health_monitor = healthy(10.0)
    health_monitor.orion_ok_at = health_monitor.stored_at = at(20.0).mono
    health_monitor.notify_detail = "Orion cannot deliver: Timeout was reached."

    found = states(health_monitor, 20.0)

    assert (found["orion"], found["iot_agent"]) == ("ok", "ok")
    assert found["notifications"] == "down"
    assert (
        hop(health_monitor, "notifications", 20.0).detail
        == health_monitor.notify_detail
    )


def test_f9_a_probe_that_orion_has_and_nobody_brought_blames_no_agent() -> None:
    health_monitor = healthy(10.0)
    for seq, second in enumerate((12.0, 14.0, 16.0)):
        health_monitor.sent(Origin("b", seq), at(second))
        health_monitor.stored(Origin("b", seq))
    health_monitor.orion_ok_at = at(17.0).mono

    found = states(health_monitor, 17.0)

    assert (found["iot_agent"], found["notifications"]) == ("ok", "down")


def test_f8_a_subscription_that_had_to_be_mended_is_told_while_others_arrive() -> None:
    health_monitor = healthy(10.0)
    health_monitor.notify_error = "Subscribed to odometry."

    assert hop(health_monitor, "notifications", 10.0) == HopHealth(
        Hop.NOTIFICATIONS, "down", 0.0, "Subscribed to odometry."
    )


def test_f4_behind_a_deaf_agent_notifications_are_not_accused() -> None:
    health_monitor = healthy(10.0)
    health_monitor.orion_ok_at = at(20.0).mono

    found = states(health_monitor, 20.0)

    assert (found["iot_agent"], found["notifications"]) == ("down", "unknown")


def test_f2_a_broker_that_confirms_nothing_is_down_though_connected() -> None:
    health_monitor = healthy(10.0)
    health_monitor.mqtt_error = "does not confirm"

    found = states(health_monitor, 20.0)

    assert found["mqtt"] == "down"
    assert (found["iot_agent"], found["notifications"]) == ("unknown", "unknown")


def test_a_probe_that_takes_long_makes_the_agent_late() -> None:
    health_monitor = healthy(10.0)
    health_monitor.sent(Origin("b", 1, "now"), at(7.0))
    health_monitor.received(Origin("b", 1), at(10.0))

    late = hop(health_monitor, "iot_agent", 10.0)

    assert (late.state, late.detail) == ("late", "measures reach Orion 3.0 s late")
    assert (late.lag_s, late.growing) == (3.0, False)


def test_measures_that_do_not_come_are_told_with_how_long_by_now() -> None:
    health_monitor = healthy(10.0)
    health_monitor.sent(Origin("b", 1, "now"), at(11.0))
    health_monitor.orion_ok_at = at(20.0).mono

    down = hop(health_monitor, "iot_agent", 20.0)

    assert (down.state, down.lag_s) == ("down", 9.0)
    assert down.detail == "measures do not reach Orion, for 9 s by now"


def behind(lags: list[float], every_s: float = 2.0) -> tuple[HealthMonitor, float]:
    """A monitor whose probes came back this late each, and when the last one did."""
    health_monitor, now = healthy(10.0), 10.0
    for seq, lag in enumerate(lags):
        now = 10.0 + every_s * seq
        health_monitor.sent(Origin("b", seq), at(now - lag))
        health_monitor.received(Origin("b", seq), at(now))
        health_monitor.orion_ok_at = health_monitor.received_at = (
            health_monitor.notified_at
        ) = at(now).mono
    return health_monitor, now


def test_the_lag_is_said_though_the_agent_answers_no_question() -> None:
    health_monitor, now = behind([15.0, 17.0, 19.0, 21.0, 23.0, 25.0, 27.0])
    health_monitor.agent_silent = "no answer to GET /iot/about in 3 s"
    health_monitor.agent_warning = "no answer to POST /iot/services in 6 s"

    late = hop(health_monitor, "iot_agent", now)

    assert (late.state, late.detail) == (
        "late",
        "measures reach Orion 27 s late, growing",
    )
    assert health_monitor.is_overloaded(at(now))


def test_a_lag_that_stays_is_said_without_growing_and_repairs_go_on() -> None:
    health_monitor, now = behind([4.0] * 7)

    assert (
        hop(health_monitor, "iot_agent", now).detail
        == "measures reach Orion 4.0 s late"
    )
    assert not health_monitor.is_overloaded(at(now))


def test_behind_a_backlog_that_grows_probes_may_come_ever_farther_apart() -> None:
    health_monitor, now = behind([5.0, 8.0, 11.0, 14.0], every_s=6.0)

    assert hop(health_monitor, "iot_agent", now + 8.0).state == "late"
    assert hop(health_monitor, "iot_agent", now + 12.1).state == "down"
    assert not health_monitor.is_overloaded(at(now + 12.1))


def test_an_agent_that_keeps_up_and_answers_no_question_is_down() -> None:
    health_monitor, now = behind([0.1] * 3)
    health_monitor.agent_silent = "no answer to GET /iot/about in 3 s"

    silent = hop(health_monitor, "iot_agent", now)

    assert (silent.state, silent.detail) == ("down", health_monitor.agent_silent)


def test_a_probe_of_an_earlier_life_proves_nothing() -> None:
    health_monitor = HealthMonitor(START)
    health_monitor.sent(Origin("new", 1), START)
    health_monitor.stored(Origin("old", 1))
    health_monitor.received(Origin("old", 1), START)

    assert (health_monitor.stored_at, health_monitor.probe.is_known) == (None, False)


@pytest.mark.parametrize("hop_name", ["orion", "iot_agent"])
def test_f7_a_neighbour_that_answers_slowly_is_late(hop_name: str) -> None:
    health_monitor = healthy(10.0)
    health_monitor.orion_slow = health_monitor.agent_slow = "answers take 2.1 s"

    slow = hop(health_monitor, hop_name, 10.0)

    assert (slow.state, slow.detail) == ("late", "answers take 2.1 s")


def test_a_device_that_may_swallow_commands_is_shown_though_measures_pass() -> None:
    health_monitor = healthy(10.0)
    health_monitor.agent_warning = "Device AAA_gps also feeds AGI."

    assert hop(health_monitor, "iot_agent", 10.0).detail == health_monitor.agent_warning
    assert not health_monitor.whole(at(10.0))


def test_what_orion_sent_before_an_outage_says_nothing_of_its_subscriptions() -> None:
    health_monitor = healthy(10.0)

    health_monitor.orion_back_at = at(11.0).mono
    before = states(health_monitor, 12.0)["notifications"]
    health_monitor.notified_at = at(11.5).mono

    assert before == "unknown"
    assert states(health_monitor, 12.0)["notifications"] == "ok"


def test_what_never_came_is_down_after_the_first_seconds() -> None:
    health_monitor = HealthMonitor(START)
    health_monitor.mqtt_connected = True
    health_monitor.orion_ok_at = at(6.0).mono

    assert states(health_monitor, 6.1)["iot_agent"] == "down"


def test_one_slow_answer_is_shown_and_two_in_a_row_are_a_fault() -> None:
    pace = Pace()

    told = [(pace.took(spent), pace.is_fault) for spent in (1.2, 0.2, 1.3, 2.0, 0.1)]

    assert told == [
        ("answers take 1.2 s", False),
        ("", False),
        ("answers take 1.3 s", False),
        ("answers take 2.0 s", True),
        ("", False),
    ]
