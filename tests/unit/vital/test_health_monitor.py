"""Which hop is broken is known by what went through it."""

import pytest

from iveg.domain.observations import Origin
from iveg.vital.health_monitor import HealthMonitor, HopHealth
from tests.builders import START, at


def states(monitor: HealthMonitor, now: float) -> dict[str, str]:
    return {hop.name: hop.state for hop in monitor.hops(at(now))}


def hop(monitor: HealthMonitor, name: str, now: float) -> HopHealth:
    return next(one for one in monitor.hops(at(now)) if one.name == name)


def healthy(now: float) -> HealthMonitor:
    monitor = HealthMonitor(START, lambda: "ok")
    monitor.mqtt_connected = True
    monitor.orion_ok_at = monitor.received_at = monitor.notified_at = at(now).mono
    return monitor


def test_nobody_is_accused_in_the_first_seconds() -> None:
    found = states(HealthMonitor(START, lambda: "unknown"), 5.9)

    assert set(found.values()) == {"unknown"}


def test_a_whole_chain_is_ok() -> None:
    assert set(states(healthy(10.0), 10.0).values()) == {"ok"}


@pytest.mark.parametrize(
    ("age", "state"), [(4.0, "ok"), (4.1, "late"), (5.5, "late"), (5.6, "down")]
)
def test_f4_an_agent_that_is_deaf_is_found_by_the_probe(age: float, state: str) -> None:
    monitor = healthy(10.0)
    monitor.notified_at = at(10.0 + age).mono

    assert states(monitor, 10.0 + age)["iot_agent"] == state


@pytest.mark.parametrize(
    ("fault", "found"),
    [
        ({"mqtt_connected": False}, ("down", "unknown", "ok", "unknown")),
        ({"mqtt_error": "does not confirm"}, ("down", "unknown", "ok", "unknown")),
        ({}, ("ok", "down", "ok", "unknown")),
        ({"orion_error": "500"}, ("ok", "unknown", "down", "unknown")),
        ({"stored_at": at(20.0).mono}, ("ok", "ok", "ok", "down")),
    ],
    ids=["f1 away", "f2 confirms nothing", "f4 deaf", "f6 down", "f8 stopped"],
)
def test_f1_f2_f4_f6_f8_while_one_hop_is_broken_nobody_behind_it_is_accused(
    fault: dict[str, object], found: tuple[str, ...]
) -> None:
    monitor = healthy(10.0)
    for name, value in {"orion_ok_at": at(20.0).mono, **fault}.items():
        setattr(monitor, name, value)

    # Ten seconds after all was well.
    judged = states(monitor, 20.0)
    hops = ("mqtt", "iot_agent", "orion", "notifications")
    assert tuple(judged[name] for name in hops) == found


def test_f9_a_probe_that_orion_has_and_nobody_brought_blames_no_agent() -> None:
    monitor = healthy(10.0)
    for seq, second in enumerate((12.0, 14.0, 16.0)):
        monitor.probe.sent(Origin("b", seq), at(second))
        monitor.stored(Origin("b", seq))
    monitor.orion_ok_at = at(17.0).mono

    found = states(monitor, 17.0)

    assert (found["iot_agent"], found["notifications"]) == ("ok", "down")


@pytest.mark.parametrize(
    ("told", "name", "state"),
    [
        ("agent_error", "iot_agent", "down"),
        ("agent_silent", "iot_agent", "down"),
        ("agent_slow", "iot_agent", "late"),
        ("agent_warning", "iot_agent", "late"),
        ("orion_slow", "orion", "late"),
        ("notify_error", "notifications", "down"),
    ],
)
def test_f3_f7_f8_what_is_told_of_a_hop_is_its_state_and_detail_while_all_else_passes(
    told: str, name: str, state: str
) -> None:
    monitor = healthy(10.0)
    setattr(monitor, told, "What was told.")

    found = hop(monitor, name, 10.0)

    assert (found.state, found.detail) == (state, "What was told.")
    assert not monitor.whole(at(10.0))


def test_a_probe_that_takes_long_makes_the_agent_late() -> None:
    monitor = healthy(10.0)
    monitor.probe.sent(Origin("b", 1, "now"), at(7.0))
    monitor.received(Origin("b", 1), at(10.0))

    late = hop(monitor, "iot_agent", 10.0)

    assert (late.state, late.detail) == ("late", "measures reach Orion 3.0 s late")
    assert late.lag_s == 3.0
