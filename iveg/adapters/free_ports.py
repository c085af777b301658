"""TCP ports that nobody listens on."""

import socket


def bind_once(host: str, port: int) -> int:
    """Bind a port for a moment; returns it, or a free one for 0.

    Raises:
        OSError: it is taken, or the host is not of this machine.
    """
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    with socket.socket(family, socket.SOCK_STREAM) as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        probe.bind((host, port))
        return int(probe.getsockname()[1])
