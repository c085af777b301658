"""Network of DDS, and Cyclone's configuration for it."""

import socket
import struct
from contextlib import suppress
from dataclasses import dataclass
from fcntl import ioctl
from pathlib import Path
from xml.sax.saxutils import quoteattr

from iveg.domain.errors import HopError

_LEASE = "3 s"
"""Time after which others forget a participant that died silently."""
_ANNOUNCED_EVERY = "2 s"
"""Time between two announcements, also to silent peers."""
_ASIDE = 'multicast="true" priority="-1"'
"""Attributes of loopback: Cyclone announces to other hosts from its first choice."""
_MOST_PARTICIPANTS = 119
"""Participants for which a domain has ports on one machine."""
_MOST_INTERFACES = 4
"""Cyclone refuses more."""
_LOOPBACK = "127.0.0.1"
_SIOCGIFADDR = 0x8915
_UP = 1


@dataclass(frozen=True, slots=True)
class DdsNetwork:
    """Domain, interface and peers of the network.

    Loopback is always used, and always a peer, as nodes may be bound to it.

    Attributes:
        domain: 0 to 232, as ``ROS_DOMAIN_ID``.
        interface: The only interface beside loopback, by name or address; empty: all.
        peers: Addresses announced to one by one, where multicast does not pass.
        uri: Value of ``CYCLONEDDS_URI``; counts where nothing above does.
    """

    domain: int = 0
    interface: str = ""
    peers: tuple[str, ...] = ()
    uri: str = ""

    def interfaces(self) -> dict[str, str]:
        """Address of each interface that belongs to the network now, by name.

        Empty where ``CYCLONEDDS_URI`` chooses.
        """
        if self.interface:
            return {
                name: address
                for name, address in _addresses().items()
                if self.interface in (name, address) or _is_loopback(address)
            }
        return {} if self.uri else _addresses()

    def config(self) -> str:
        """Cyclone's configuration: ``uri`` and our own fragment, which counts more.

        Raises:
            HopError: the interface, or an address of a peer, does not exist.
        """
        return ",".join(part for part in (self.uri, self._own()) if part)

    def _own(self) -> str:
        general = discovery = ""
        chosen = self.interfaces()
        if self.interface and self.interface not in (*chosen, *chosen.values()):
            there = ", ".join(_addresses())
            raise HopError("dds", f"no interface {self.interface}; there are {there}")
        used = "".join(
            f"<NetworkInterface name={quoteattr(name)}"
            f" {_ASIDE * _is_loopback(address)}/>"
            for name, address in usable_interfaces(chosen).items()
        )
        if used:
            general = f"<Interfaces>{used}</Interfaces>"
        if used or self.peers:
            general += "<AllowMulticast>spdp</AllowMulticast>"
            discovery = (
                "<ParticipantIndex>auto</ParticipantIndex>"
                f"<MaxAutoParticipantIndex>{_MOST_PARTICIPANTS}"
                f"</MaxAutoParticipantIndex><Peers>{self._peer_tags()}</Peers>"
            )
        discovery += (
            f"<LeaseDuration>{_LEASE}</LeaseDuration>"
            f"<SPDPInterval>{_ANNOUNCED_EVERY}</SPDPInterval>"
        )
        return (
            f'<CycloneDDS><Domain Id="any"><General>{general}</General>'
            f"<Discovery>{discovery}</Discovery></Domain></CycloneDDS>"
        )

    def _peer_tags(self) -> str:
        """Peers for ever: by itself Cyclone forgets a peer that is silent for 30 s."""
        for peer in self.peers:
            host = peer.partition(":")[0] if peer.count(":") == 1 else peer
            try:
                # Cyclone aborts the process for an unknown host.
                socket.gethostbyname(host)
            except OSError as error:
                raise HopError("dds", f"peer {peer}: {error.strerror}") from error
        return "".join(
            f'<Peer address={quoteattr(peer)} PruneDelay="inf"/>'
            for peer in dict.fromkeys((_LOOPBACK, *self.peers))
        )


def usable_interfaces(interfaces: dict[str, str]) -> dict[str, str]:
    """Interfaces for Cyclone: hardware before bridges and tunnels, and loopback.

    Loopback is last, as Cyclone announces to peers from the first.
    """
    here = [name for name in interfaces if _is_loopback(interfaces[name])][:1]
    others = sorted(
        (name for name in interfaces if not _is_loopback(interfaces[name])),
        key=lambda name: not Path("/sys/class/net", name, "device").exists(),
    )
    names = others[: _MOST_INTERFACES - len(here)] + here
    return {name: interfaces[name] for name in names}


def _is_loopback(address: str) -> bool:
    return address.startswith("127.")


def _addresses() -> dict[str, str]:
    """IPv4 address of each interface of this machine that is up and has one."""
    addresses: dict[str, str] = {}
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        for _, name in socket.if_nameindex():
            # An interface may vanish between two calls.
            with suppress(OSError):
                flags = Path("/sys/class/net", name, "flags").read_text("ascii")
                answer = ioctl(probe, _SIOCGIFADDR, struct.pack("40s", name.encode()))
                if int(flags, 16) & _UP:
                    addresses[name] = socket.inet_ntoa(answer[20:24])
    return addresses
