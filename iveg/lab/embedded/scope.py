"""Whose data a request is about, and when it came."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Scope:
    """Tenant and service path of a request, and its time.

    Attributes:
        service: Tenant, lower case; empty for the default one.
        path: Service path, or several, or ``/#`` for reading.
        correlator: Correlator of the chain of requests.
        now: Seconds, Unix time.
    """

    service: str
    path: str
    correlator: str
    now: float
