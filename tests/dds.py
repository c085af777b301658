"""DDS for tests: loopback, no multicast, a domain that no other test process uses.

Tests take the adapter from here, so that a Python without a wheel of ``cyclonedds``
leaves them out.
"""

import os
import socket
import subprocess
import sys

import pytest

pytest.importorskip("cyclonedds")

from iveg.adapters.dds import Dds
from iveg.adapters.dds_network import DdsNetwork
from tests.bonds import bound
from tests.processes import ROOT

__all__ = ["Dds", "DdsNetwork", "free_domain", "loopback", "start_stranger"]

_BASE, _GAIN, _DOMAINS = 7400, 250, 100
"""RTPS: ports of domain d begin at 7400 + 250 d; above 100 Linux hands them out."""


def free_domain() -> int:
    """A domain whose first ports are free."""
    start = os.getpid() % _DOMAINS
    for step in range(_DOMAINS):
        domain = 1 + (start + 37 * step) % _DOMAINS
        if _is_free(_BASE + _GAIN * domain + 10):
            return domain
    raise OSError("all DDS domains are in use")


def _is_free(port: int) -> bool:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.bind(("127.0.0.1", port))
        except OSError:
            return False
    return True


def loopback(domain: int) -> DdsNetwork:
    """A network that stays on this machine."""
    return DdsNetwork(domain, "127.0.0.1", ("127.0.0.1",))


def start_stranger(node: str, domain: int) -> subprocess.Popen[str]:
    """A process with a node of somebody else (``tests.integration.dds_stranger``)."""
    program = (sys.executable, "-m", "tests.integration.dds_stranger")
    return subprocess.Popen(
        bound(*program, node, f"{domain}"),
        cwd=ROOT,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        stdout=subprocess.PIPE,
        text=True,
    )
