"""Who may stay connected where there are more than a listener bears."""

import resource
from dataclasses import dataclass, field

import pytest

from iveg.adapters.connection_caps import ConnectionCaps
from iveg.adapters.connections import Connection, ConnectionTable
from iveg.adapters.networks import network_of

CAPS = ConnectionCaps(
    connections=8, of_strangers=6, of_an_address=4, head_s=5.0, body_s=30.0
)
ANA, BEN, EVE, PROXY = "10.0.0.1", "10.0.0.2", "10.0.0.66", "10.0.0.9"


@dataclass
class Listener:
    """A table whose clock is moved by hand."""

    time: float = 0.0
    ended: list[str] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.table = ConnectionTable(lambda: self.time, CAPS, PROXY.__eq__)

    def connect(self, name: str, address: str) -> Connection | None:
        """Somebody connects, a hundredth of a second after the one before."""
        self.time += 0.01
        return self.table.admit(address, lambda: self.ended.append(name))

    def connected(self, name: str, address: str) -> Connection:
        connection = self.connect(name, address)
        assert connection is not None
        return connection

    def served(self, name: str, address: str) -> Connection:
        """Somebody whose request is signed in and is being answered."""
        connection = self.connected(name, address)
        connection.await_body()
        connection.serve()
        connection.vouch()
        return connection


def test_the_oldest_half_sent_request_of_an_address_gives_way_to_its_newest() -> None:
    listener = Listener()
    for number in range(6):
        listener.connected(f"eve {number}", EVE)

    assert listener.ended == ["eve 0", "eve 1"]
    assert len(listener.table) == CAPS.of_an_address


def test_one_address_takes_no_place_of_another() -> None:
    listener = Listener()
    listener.connected("ana", ANA)
    for number in range(1000):
        listener.connected(f"eve {number}", EVE)

    assert "ana" not in listener.ended


def test_of_many_strangers_the_one_with_the_most_gives_way() -> None:
    listener = Listener()
    for number, address in enumerate((EVE, EVE, EVE, ANA, ANA, BEN)):
        listener.connected(f"{number}", address)
    listener.connected("another", "10.0.0.3")

    assert listener.ended == ["0"]


def test_strangers_leave_a_share_to_addresses_that_have_signed_in() -> None:
    listener = Listener()
    listener.table.remember(ANA)
    for number in range(20):
        listener.connected(f"eve {number}", f"10.1.{number}.1")
    listener.ended.clear()

    listener.connected("ana", ANA)
    listener.connected("ana too", ANA)

    assert listener.ended == []
    assert len(listener.table) == CAPS.connections


def test_an_address_that_nobody_has_signed_in_from_for_long_is_a_stranger() -> None:
    listener = Listener()
    listener.table.remember(ANA)
    for number in range(20):
        listener.connected(f"eve {number}", f"10.1.{number}.1")
    listener.ended.clear()
    listener.time += 13 * 3600.0

    listener.connected("ana", ANA)

    assert len(listener.ended) == 1


def test_what_is_open_and_signed_in_never_gives_way() -> None:
    listener = Listener()
    for number in range(4):
        listener.served(f"socket {number}", ANA)

    assert listener.connect("one more", ANA) is None
    assert listener.ended == []
    assert listener.table.counters == {"connections.refused": 1}


def test_a_signed_in_line_that_rests_gives_way_after_all_that_are_not() -> None:
    listener = Listener()
    resting = listener.served("ana", ANA)
    resting.rest()
    for number in range(4):
        listener.connected(f"half sent {number}", ANA)

    assert listener.ended == ["half sent 0"]


def test_a_head_has_five_seconds_and_a_body_thirty() -> None:
    listener = Listener()
    listener.connected("head", ANA)
    listener.connected("body", ANA).await_body()
    listener.connected("served", ANA).serve()
    listener.time += 4.9
    listener.table.end_overdue()
    at_first = list(listener.ended)
    listener.time += 0.2
    listener.table.end_overdue()
    after_five = list(listener.ended)
    listener.time += 30.0
    listener.table.end_overdue()

    assert (at_first, after_five) == ([], ["head"])
    assert listener.ended == ["head", "body"]
    assert listener.table.counters == {"connections.late": 2}


def test_clients_behind_one_proxy_are_told_apart() -> None:
    listener = Listener()
    bens = listener.connected("ben", PROXY)
    assert bens.belongs_to(BEN)
    bens.serve()
    for number in range(5):
        listener.connected(f"eve {number}", PROXY).belongs_to(EVE)

    assert listener.ended == ["eve 0"]


def test_a_proxy_has_no_cap_of_its_own() -> None:
    listener = Listener()
    for number in range(CAPS.of_strangers):
        listener.connected(f"{number}", PROXY)

    assert listener.ended == []


def test_a_flood_is_one_line_in_the_log(caplog: pytest.LogCaptureFixture) -> None:
    listener = Listener()
    for number in range(1000):
        listener.connected(f"eve {number}", EVE)

    assert caplog.messages == [
        f"connections of {EVE}: too many, the oldest gives way",
    ]
    assert listener.table.counters == {"connections.gave_way": 996}


@pytest.mark.parametrize(
    ("address", "network"),
    [
        ("10.0.0.1", "10.0.0.1"),
        ("::ffff:10.0.0.1", "10.0.0.1"),
        ("2001:db8:1:2:3:4:5:6", "2001:db8:1:2::"),
        ("fe80::1%eth0", "fe80::"),
        ("", ""),
        ("x" * 1000, "x" * 64),
    ],
)
def test_an_ipv6_host_is_one_network(address: str, network: str) -> None:
    assert network_of(address) == network


def test_half_of_the_file_descriptors_are_left_to_everything_else(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(resource, "getrlimit", lambda _: (256, 256))

    assert ConnectionCaps.for_this_process().connections == 128
