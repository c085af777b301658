"""What a listener bears: connections, and the process's open files."""

import resource
from dataclasses import dataclass

_MOST_DESCRIPTORS = 4096


def raise_descriptor_limit() -> None:
    """Allow this process as many open files as it may have by itself, in reason."""
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    wanted = _MOST_DESCRIPTORS if hard == resource.RLIM_INFINITY else hard
    wanted = min(wanted, _MOST_DESCRIPTORS)
    if soft != resource.RLIM_INFINITY and soft < wanted:
        resource.setrlimit(resource.RLIMIT_NOFILE, (wanted, hard))


@dataclass(frozen=True, slots=True)
class ConnectionCaps:
    """What a listener bears.

    Attributes:
        connections: In all.
        of_strangers: Of addresses that nobody has signed in from.
        of_an_address: Of one address; of IPv6 one network of 64 bits.
        head_bytes: Request line and headers of one request.
        head_s: Time in which they have to be here (s); ``body_s`` the body after them.
    """

    connections: int = 512
    of_strangers: int = 384
    of_an_address: int = 192
    head_bytes: int = 16_384
    head_s: float = 5.0
    body_s: float = 30.0

    @classmethod
    def for_this_process(cls, listeners: int = 1) -> "ConnectionCaps":
        """As many as leave a share of the file descriptors to everything else.

        Args:
            listeners: Of this process; each has as large a share.
        """
        soft, _ = resource.getrlimit(resource.RLIMIT_NOFILE)
        most = cls().connections
        if soft != resource.RLIM_INFINITY:
            most = max(8, min(most, soft // (listeners + 1)))
        return cls(most, most * 3 // 4, most * 3 // 8)

    @classmethod
    def on_loopback(cls) -> "ConnectionCaps":
        """Of one of the three listeners whose clients are all on this machine.

        One address has all.
        """
        most = cls.for_this_process(3).connections
        return cls(most, most, most)
