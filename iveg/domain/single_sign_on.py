"""What an identity provider's claims mean here: a person, a name, a role.

A claim's path fits the shapes of the providers (docs/deployment.md, "Single sign-on"):
``realm_access.roles`` (Keycloak), ``roles`` or ``groups`` (Entra), ``roles[].name``
(Keyrock).  Lists on the way are gone through, with or without ``[]``.
"""

import hashlib
import unicodedata
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Final, Literal

from iveg.domain.accounts import MOST_NAME, PersonRole, is_name
from iveg.domain.records import Json

SignOnFailure = Literal[
    "unreachable",
    "refused",
    "outdated",
    "untrusted",
    "no_role",
    "disabled",
    "not_renewed",
    "busy",
]
"""Why a sign-in at the provider let nobody in: it did not answer, or said no; the
answer belongs to no sign-in that waits, or proves nothing; the person has no role here,
or is disabled here, or did not sign in anew; too many sign in at once."""

_RANKS: Final[tuple[PersonRole, ...]] = ("viewer", "operator", "admin")
_MOST_VALUES: Final = 1000


@dataclass(frozen=True, slots=True)
class ProvenIdentity:
    """A person as the provider vouches for them.

    Attributes:
        person: Stable id of the account, made from issuer and subject.
        role: The highest that the claims give; None: none.
        auth_time: When they proved who they are (Unix s); None: not told.
    """

    person: str
    name: str
    role: PersonRole | None
    auth_time: float | None


@dataclass(frozen=True, slots=True)
class ClaimReading:
    """Where name and role stand in a provider's claims.

    Attributes:
        roles: Value of a claim → the role that it gives.
    """

    role_claim: str
    name_claim: str
    roles: Mapping[str, PersonRole]

    def read(self, issuer: str, subject: str, claims: Json) -> ProvenIdentity:
        """The person whom claims are about.

        Args:
            issuer: Whose claims they are.
            subject: Id of the person there.
            claims: What is told; of it nothing but strings and numbers counts.
        """
        person = person_id(issuer, subject)
        claimed = next(values_at(claims, self.name_claim), "")
        return ProvenIdentity(
            person,
            name_of(claimed, person),
            highest_role(values_at(claims, self.role_claim), self.roles),
            _time_of(claims.get("auth_time")),
        )


def _time_of(claim: object) -> float | None:
    """A moment (Unix s); None where none is told that may be one."""
    if not isinstance(claim, int | float) or isinstance(claim, bool):
        return None
    return float(claim) if 0.0 <= claim < 1e12 else None


def person_id(issuer: str, subject: str) -> str:
    """Id of a person of a provider: neither their name nor the provider's address."""
    digest = hashlib.sha256(f"{issuer}\0{subject}".encode()).hexdigest()
    return f"sso-{digest[:32]}"


def name_of(claim: str, person: str) -> str:
    """A name that somebody may have, close to what is told; else part of the id."""
    kept = unicodedata.normalize("NFC", claim[: 4 * MOST_NAME])
    kept = "".join(one for one in kept if is_name(f"x{one}x")).strip()[:MOST_NAME]
    return kept if is_name(kept := kept.strip()) else person[:12]


def another_name(name: str, person: str) -> str:
    """The name of somebody whose own is taken: with a part of the id behind it."""
    mark = f" {person.removeprefix('sso-')[:6]}"
    return f"{name[: MOST_NAME - len(mark)].rstrip()}{mark}"


def highest_role(
    values: Iterable[str], roles: Mapping[str, PersonRole]
) -> PersonRole | None:
    """The highest role among those that some values give; None: none."""
    given = {roles[value] for value in values if value in roles}
    return max(given, key=_RANKS.index, default=None)


def values_at(claims: Json, path: str) -> Iterator[str]:
    """Strings at a path, such as ``realm_access.roles`` or ``roles[].name``.

    A claim whose own name is the path, dots and all, comes first.
    """
    if path in claims:
        found = _walk(claims[path], ())
    else:
        found = _walk(claims, tuple(path.replace("[]", "").split(".")))
    for _, value in zip(range(_MOST_VALUES), found, strict=False):
        yield value


def _walk(value: object, path: tuple[str, ...]) -> Iterator[str]:
    if isinstance(value, list):
        for one in value:
            # Of a list inside a list nothing is read: no provider has one.
            if not isinstance(one, list):
                yield from _walk(one, path)
    elif path and isinstance(value, dict):
        yield from _walk(value.get(path[0]), path[1:])
    elif not path and isinstance(value, str):
        yield value
