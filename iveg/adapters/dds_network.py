"""The network that DDS runs on, as Cyclone is configured for it."""

from dataclasses import dataclass
from xml.sax.saxutils import quoteattr

_LEASE = "3 s"
"""How long others remember a participant that died without a word."""


_MOST_PARTICIPANTS = 60


@dataclass(frozen=True, slots=True)
class DdsNetwork:
    """Domain, interface and peers of the network.

    Attributes:
        domain: 0 to 232, as ``ROS_DOMAIN_ID``.
        interface: Network interface by name or address; empty: Cyclone's choice.
        peers: Addresses to ask instead of the whole network; none: multicast.
        uri: What ``CYCLONEDDS_URI`` says; counts where nothing above does.
    """

    domain: int = 0
    interface: str = ""
    peers: tuple[str, ...] = ()
    uri: str = ""

    def config(self) -> str:
        """Cyclone's configuration, one fragment after the other."""
        return ",".join(part for part in (self.uri, self._own()) if part)

    def _own(self) -> str:
        general = discovery = ""
        if self.interface:
            key = "address" if self.interface[0].isdigit() else "name"
            one = f"{key}={quoteattr(self.interface)}"
            general += f"<Interfaces><NetworkInterface {one}/></Interfaces>"
        if self.peers:
            general += "<AllowMulticast>false</AllowMulticast>"
            peers = "".join(f"<Peer address={quoteattr(one)}/>" for one in self.peers)
            discovery = (
                "<ParticipantIndex>auto</ParticipantIndex>"
                f"<MaxAutoParticipantIndex>{_MOST_PARTICIPANTS}"
                f"</MaxAutoParticipantIndex><Peers>{peers}</Peers>"
            )
        discovery += f"<LeaseDuration>{_LEASE}</LeaseDuration>"
        return (
            f'<CycloneDDS><Domain Id="any"><General>{general}</General>'
            f"<Discovery>{discovery}</Discovery></Domain></CycloneDDS>"
        )
