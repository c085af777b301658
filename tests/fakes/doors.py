"""An authenticator for tests that need no more than a session."""

from iveg.vital.audit import AuditTrail
from iveg.vital.ports import Clock
from iveg.web.security.authentication import Authenticator, Credentials
from iveg.web.security.people import People
from tests.fakes.accounts import FakeBook, FakePasswords
from tests.fakes.recorder import FakeRecorder


def authenticator(
    clock: Clock,
    link: str = "cd" * 32,
    api_token: str = "",
    link_name: str = "operator",
) -> Authenticator:
    """Knows nobody by account; its audit goes nowhere."""
    people = People(FakeBook(), FakePasswords(), clock)
    trail = AuditTrail(FakeRecorder(), lambda: "id")
    return Authenticator(Credentials(link, api_token, link_name), people, trail)
