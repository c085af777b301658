"""Tenant and service path of a request."""

import re

from iveg.lab.embedded.entities import Scope
from iveg.lab.embedded.errors import bad_request
from iveg.lab.embedded.http_server import Request

_SERVICE = re.compile(r"[a-z0-9_]{0,50}")


_PATH = re.compile(r"/|(/[A-Za-z0-9_]{1,50}){1,10}")


def read_scope(request: Request, correlator: str, now: float) -> Scope:
    """Tenant and service path of a request.

    Raises:
        FiwareError: 400, invalid tenant or service path.
    """
    service = request.headers.get("fiware-service", "").lower()
    if _SERVICE.fullmatch(service) is None:
        raise bad_request(
            "bad character in tenant name - only underscore and alphanumeric "
            "characters are allowed"
        )
    reads = request.method == "GET"
    path = request.headers.get("fiware-servicepath", "/#" if reads else "/")
    if not path.startswith("/"):
        raise bad_request(
            "Only /absolute/ Service Paths allowed [a service path must begin with /]"
        )
    if _PATH.fullmatch(path) is None and not (reads and path == "/#"):
        raise bad_request("Bad Character in Service-Path")
    return Scope(service, path, correlator, now)
