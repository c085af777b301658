"""Networks on which a gate meets publishers."""

import pytest

from iveg.adapters import dds_network
from iveg.adapters.dds_network import DdsNetwork, usable_interfaces

MACHINE = {"lo": "127.0.0.1"} | {f"iveg{n}": f"192.0.2.{n + 1}" for n in range(4)}


@pytest.fixture(autouse=True)
def machine(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(dds_network, "_addresses", lambda: MACHINE)


def test_as_many_interfaces_as_cyclone_takes_are_used_and_loopback_last() -> None:
    used = list(usable_interfaces(DdsNetwork().interfaces()))

    assert used == ["iveg0", "iveg1", "iveg2", "lo"]


@pytest.mark.parametrize(
    ("network", "used"),
    [
        (DdsNetwork(interface="iveg1"), ["lo", "iveg1"]),
        (DdsNetwork(interface="192.0.2.4"), ["lo", "iveg3"]),
        (DdsNetwork(interface="127.0.0.1"), ["lo"]),
        (DdsNetwork(uri="<CycloneDDS/>"), []),
        (DdsNetwork(interface="iveg0", uri="<CycloneDDS/>"), ["lo", "iveg0"]),
    ],
)
def test_an_interface_that_is_named_is_used_beside_loopback(
    network: DdsNetwork, used: list[str]
) -> None:
    assert list(network.interfaces()) == used


def test_a_configuration_of_the_site_is_left_alone() -> None:
    config = DdsNetwork(uri="<CycloneDDS/>").config()

    assert config.startswith("<CycloneDDS/>,")
    assert "Interfaces" not in config
    assert "Peers" not in config


def test_peers_are_asked_for_ever_and_so_is_this_machine() -> None:
    config = DdsNetwork(peers=("192.0.2.9",)).config()

    for peer in ("127.0.0.1", "192.0.2.9"):
        assert f'<Peer address="{peer}" PruneDelay="inf"/>' in config
