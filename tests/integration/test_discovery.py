"""Whoever starts after the gate is met: another publisher, and a late listener."""

import time

import pytest

from iveg.robot.ros2.checking import Lookout
from iveg.robot.ros2.config import RobotConfig
from iveg.robot.ros2.reading import InputFaults
from iveg.ros2 import cdr, names
from iveg.ros2 import messages as ros
from tests.dds import Dds, DdsNetwork, free_domain, start_stranger
from tests.processes import until

_WITHIN_S = 8.0
HERE = ("127.0.0.1",)
EVERYWHERE = ["jazzy", "humble", "jazzy on this machine", "humble on this machine"]
NETWORK = next(
    (one for one in DdsNetwork().interfaces().values() if one not in HERE), ""
)


@pytest.mark.parametrize(
    ("interface", "peers", "nodes"),
    [
        ("", (), EVERYWHERE),
        ("", HERE, EVERYWHERE[::2]),
        (NETWORK, HERE, EVERYWHERE[::2]),
        ("127.0.0.1", HERE, EVERYWHERE[2:]),
    ],
    ids=["by default", "peers", "interface and peers", "loopback and peers"],
)
def test_who_starts_after_the_gate_is_met_and_hears_it(
    interface: str, peers: tuple[str, ...], nodes: list[str]
) -> None:
    if not NETWORK:
        nodes = [one for one in nodes if "this machine" in one]
    faults = InputFaults()
    lookout = Lookout(RobotConfig(), faults, time.monotonic())
    domain = free_domain()
    zero = cdr.write(ros.Twist())
    with Dds(DdsNetwork(domain, interface, peers)) as gate:
        writer = gate.writer("/cmd_vel", ros.Twist, names.DEFAULT)
        assert not [one for one in gate.endpoints() if not one.own]
        strangers = [start_stranger(node, domain) for node in nodes]

        def met() -> bool:
            writer.write(zero)
            found = gate.endpoints()
            lookout.look(found, time.monotonic())
            rogues = [one for one in found if one.writes and not one.own]
            return len(rogues) == writer.readers == len(nodes)

        try:
            until(met, f"{nodes} are met", _WITHIN_S + len(nodes))
            writer.write(zero)
            words = [one.stdout.readline() for one in strangers if one.stdout]
        finally:
            for one in strangers:
                one.kill()
                one.communicate()

    assert words == ["heard\n"] * len(nodes)
    codes = {one.code for one in faults.faults(time.monotonic())}
    assert "second_publisher" in codes
