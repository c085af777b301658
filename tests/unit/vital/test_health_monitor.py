"""Which hop is broken is known by what went through it."""

import pytest

from iveg.domain.observations import Origin
from iveg.domain.probe import Hop
from iveg.vital.health_monitor import HealthMonitor, HopHealth
from tests.builders import START, at


def states(monitor: HealthMonitor, now: float) -> dict[str, str]:
    return {hop.name: hop.state for hop in monitor.hops(at(now))}


def hop(monitor: HealthMonitor, name: str, now: float) -> HopHealth:
    return next(one for one in monitor.hops(at(now)) if one.name == name)


def behind_broker(monitor: HealthMonitor) -> tuple[str, ...]:
    """Broker, agent, Orion and notifications, ten seconds after all was well."""
    found = states(monitor, 20.0)
    return tuple(
        found[name] for name in ("mqtt", "iot_agent", "orion", "notifications")
    )


def healthy(now: float) -> HealthMonitor:
    monitor = HealthMonitor(START, lambda: "ok")
    monitor.mqtt_connected = True
    monitor.orion_ok_at = monitor.received_at = monitor.notified_at = at(now).mono
    return monitor


def test_nobody_is_accused_in_the_first_seconds() -> None:
    found = states(HealthMonitor(START, lambda: "unknown"), 5.9)

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
    monitor = healthy(10.0)
    monitor.notified_at = at(10.0 + age).mono

    assert states(monitor, 10.0 + age)["iot_agent"] == state


def test_f3_an_agent_that_does_not_answer_is_down_at_once() -> None:
    monitor = healthy(10.0)
    monitor.agent_error = "cannot be reached"

    assert states(monitor, 10.0)["iot_agent"] == "down"


def test_f6_while_orion_is_down_nobody_behind_it_is_accused() -> None:
    monitor = healthy(10.0)
    monitor.orion_error = "500"

    assert behind_broker(monitor) == ("ok", "unknown", "down", "unknown")


@pytest.mark.parametrize(
    "fault", [{"mqtt_connected": False}, {"mqtt_error": "does not confirm"}]
)
def test_f1_f2_while_the_broker_is_away_or_confirms_nothing_it_alone_is_accused(
    fault: dict[str, object],
) -> None:
    monitor = healthy(10.0)
    for name, value in fault.items():
        setattr(monitor, name, value)

    mqtt, agent, _, notifications = behind_broker(monitor)
    assert (mqtt, agent, notifications) == ("down", "unknown", "unknown")


def test_f8_notifications_that_stopped_are_found_while_orion_answers() -> None:
    monitor = healthy(10.0)
    monitor.orion_ok_at = monitor.stored_at = at(20.0).mono
    monitor.notify_detail = "Orion cannot deliver: Timeout was reached."

    found = states(monitor, 20.0)

    assert (found["orion"], found["iot_agent"]) == ("ok", "ok")
    assert found["notifications"] == "down"
    assert hop(monitor, "notifications", 20.0).detail == monitor.notify_detail


def test_f9_a_probe_that_orion_has_and_nobody_brought_blames_no_agent() -> None:
    monitor = healthy(10.0)
    for seq, second in enumerate((12.0, 14.0, 16.0)):
        monitor.sent(Origin("b", seq), at(second))
        monitor.stored(Origin("b", seq))
    monitor.orion_ok_at = at(17.0).mono

    found = states(monitor, 17.0)

    assert (found["iot_agent"], found["notifications"]) == ("ok", "down")


def test_f8_a_subscription_that_had_to_be_mended_is_told_while_others_arrive() -> None:
    monitor = healthy(10.0)
    monitor.notify_error = "Subscribed to odometry."

    assert hop(monitor, "notifications", 10.0) == HopHealth(
        Hop.NOTIFICATIONS, "down", 0.0, "Subscribed to odometry."
    )


def test_f4_behind_a_deaf_agent_notifications_are_not_accused() -> None:
    monitor = healthy(10.0)
    monitor.orion_ok_at = at(20.0).mono

    found = states(monitor, 20.0)

    assert (found["iot_agent"], found["notifications"]) == ("down", "unknown")


def test_a_probe_that_takes_long_makes_the_agent_late() -> None:
    monitor = healthy(10.0)
    monitor.sent(Origin("b", 1, "now"), at(7.0))
    monitor.received(Origin("b", 1), at(10.0))

    late = hop(monitor, "iot_agent", 10.0)

    assert (late.state, late.detail) == ("late", "measures reach Orion 3.0 s late")
    assert late.lag_s == 3.0


def behind(lags: list[float], every_s: float = 2.0) -> tuple[HealthMonitor, float]:
    """A monitor whose probes came back this late each, and when the last one did."""
    monitor, now = healthy(10.0), 10.0
    for seq, lag in enumerate(lags):
        now = 10.0 + every_s * seq
        monitor.sent(Origin("b", seq), at(now - lag))
        monitor.received(Origin("b", seq), at(now))
        monitor.orion_ok_at = monitor.received_at = monitor.notified_at = at(now).mono
    return monitor, now


def test_an_agent_that_keeps_up_and_answers_no_question_is_down() -> None:
    monitor, now = behind([0.1] * 3)
    monitor.agent_silent = "no answer to GET /iot/about in 3 s"

    silent = hop(monitor, "iot_agent", now)

    assert (silent.state, silent.detail) == ("down", monitor.agent_silent)


@pytest.mark.parametrize("hop_name", ["orion", "iot_agent"])
def test_f7_a_neighbour_that_answers_slowly_is_late(hop_name: str) -> None:
    monitor = healthy(10.0)
    monitor.orion_slow = monitor.agent_slow = "answers take 2.1 s"

    slow = hop(monitor, hop_name, 10.0)

    assert (slow.state, slow.detail) == ("late", "answers take 2.1 s")


def test_a_device_that_may_swallow_commands_is_shown_though_measures_pass() -> None:
    monitor = healthy(10.0)
    monitor.agent_warning = "Device AAA_gps also feeds AGI."

    assert hop(monitor, "iot_agent", 10.0).detail == monitor.agent_warning
    assert not monitor.whole(at(10.0))
