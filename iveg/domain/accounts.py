"""Access: accounts, tokens of programs, sessions, and claims of providers.

A name travels with each STOP through Orion, which refuses some characters with the
whole update they stand in; such a name would stop nothing by that transport.  All of
it is held in memory while iVeg runs: neither a disk nor a database that is away, slow
or damaged changes who may stop.
"""

import hashlib
import unicodedata
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Final, Literal, TypeVar

from iveg.domain.audit import CONSOLE, Actor
from iveg.domain.errors import NameTakenError, SignOnError
from iveg.domain.records import Json

SignInMethod = Literal["link", "password", "sso", "token"]
"""Proof of an identity: ``sso`` is the identity provider's, ``token`` a program's."""
OF_ACCOUNTS: Final = frozenset({"password", "sso"})
"""Methods of people with an account, which decides over their sessions."""
PersonRole = Literal["viewer", "operator", "admin"]
AccountState = Literal["active", "invited", "over", "disabled"]
"""``over``: ended by itself."""
TokenScope = Literal["read", "stop", "operate"]
"""Rights of a program: read; also stop; also release, resume and all else of people."""

LINK_PERSON: Final = "link"
"""Id of whoever holds the link of the environment."""
DEFAULT_NAME: Final = "operator"
"""The name of that person where the settings give none."""
MOST_NAME: Final = 64
_REFUSED: Final = frozenset("<>\"'=;()")
_RESERVED: Final = frozenset(
    {"console", "iveg", "link", "nobody", "program", DEFAULT_NAME}
)


def is_name(text: str) -> bool:
    """Whether a person may be called so: short, visible, and taken by Orion."""
    return (
        0 < len(text) <= MOST_NAME
        and text == unicodedata.normalize("NFC", text).strip()
        and _REFUSED.isdisjoint(text)
        and not any(unicodedata.category(character)[0] == "C" for character in text)
    )


def is_reserved(name: str) -> bool:
    """Whether the record calls somebody so who has no account, as iVeg itself."""
    return name_key(name) in _RESERVED


def name_key(name: str) -> str:
    """Key that two names may not share: case and width do not tell people apart."""
    return unicodedata.normalize("NFKC", name).casefold().strip()


def digest_of(secret: str) -> str:
    """SHA-256 (hex) of an invitation or a token, which is all that is kept of it."""
    return hashlib.sha256(secret.encode()).hexdigest()


@dataclass(frozen=True, slots=True)
class Account:
    """A person who may sign in.

    Attributes:
        account_id: Never given anew, as names may be.
        password: Its hash (PHC string format); empty until the invitation is accepted.
        ends_at: When it closes by itself (Unix s); None: never.
        invitation: SHA-256 of what is waited for (hex); empty: nothing.
        invited_until: When the invitation is over (Unix s).
        since: Sessions that began before are over (Unix s): a new role or password.
        provider: Issuer that vouches for the person and gives the role; empty: none.
    """

    account_id: str
    name: str
    role: PersonRole
    password: str = ""
    disabled: bool = False
    ends_at: float | None = None
    invitation: str = ""
    invited_until: float = 0.0
    since: float = 0.0
    provider: str = ""

    def is_open(self, now: float) -> bool:
        """Whether the person may be here at this moment (Unix s)."""
        return not self.disabled and (self.ends_at is None or now < self.ends_at)

    def state(self, now: float) -> AccountState:
        """State of the account at this moment (Unix s)."""
        if not self.is_open(now):
            return "disabled" if self.disabled else "over"
        return "active" if self.password or self.provider else "invited"


@dataclass(frozen=True, slots=True)
class ApiToken:
    """A program that may call, by a token of which the digest is kept.

    Attributes:
        digest: SHA-256 of the token (hex).
        made_at: When (Unix s); ``used_at`` when it was used last, to a minute.
        ends_at: When it ends by itself (Unix s); None: never.
    """

    token_id: str
    name: str
    scope: TokenScope
    digest: str
    made_at: float
    used_at: float | None = None
    ends_at: float | None = None

    def is_open(self, now: float) -> bool:
        """Whether it lets the program in at this moment (Unix s)."""
        return self.ends_at is None or now < self.ends_at


@dataclass(frozen=True, slots=True)
class Session:
    """A signed-in person.

    Attributes:
        digest: SHA-256 of the token (hex).
        role: What they were when they came.
        began: Unix time of the sign-in (s).
        person: Id of the account; empty in sessions of earlier versions.
        method: How they signed in.
    """

    digest: str
    name: str
    role: PersonRole
    began: float
    person: str = ""
    method: SignInMethod = "link"

    @property
    def key(self) -> bytes:
        """The digest, by which a session is found."""
        return bytes.fromhex(self.digest)

    @property
    def session_id(self) -> str:
        """Names it to people; tells nobody the digest, and lets nobody in."""
        return digest_of(f"id:{self.digest}")[:16]


@dataclass(frozen=True, slots=True)
class Access:
    """All who may come in, at one moment."""

    accounts: tuple[Account, ...] = ()
    tokens: tuple[ApiToken, ...] = ()
    sessions: tuple[Session, ...] = ()


MOST_SESSIONS: Final = 1000


@dataclass(frozen=True, slots=True)
class AccessChange:
    """A change of somebody's rights, as the audit tells it.

    Attributes:
        row: What is kept from now on.
        gone: It is kept no longer.
    """

    action: str
    row: Account | ApiToken
    details: Json = field(default_factory=dict)
    gone: bool = False
    by: Actor = CONSOLE


class AccessBook:
    """Accounts by id, tokens by digest (hex), sessions by digest.

    Attributes:
        on_change: Told of each change of rights, once it counts.
        on_keep: Called when something is to be remembered; they return at once.
    """

    def __init__(self, kept: Access = Access()) -> None:
        self.accounts = {account.account_id: account for account in kept.accounts}
        self.tokens = {token.digest: token for token in kept.tokens}
        self.sessions = {session.key: session for session in kept.sessions}
        self.on_change: list[Callable[[AccessChange], None]] = []
        self.on_keep: list[Callable[[], None]] = []

    def picture(self) -> Access:
        """All of it at this moment."""
        return Access(
            tuple(self.accounts.values()),
            tuple(self.tokens.values()),
            tuple(self.sessions.values()),
        )

    def keep(self) -> None:
        """Have what is known now remembered."""
        for keep in self.on_keep:
            keep()

    def add(self, earlier: Access) -> None:
        """Take in what is not known yet."""
        before = AccessBook(earlier)
        self.accounts = before.accounts | self.accounts
        self.tokens = before.tokens | self.tokens
        self.sessions = before.sessions | self.sessions
        self.keep()

    def apply(self, change: AccessChange) -> None:
        """Have a change count, from the next request of each session on, too.

        Raises:
            NameTakenError: somebody or some program else is called so.
        """
        row = change.row
        if isinstance(row, Account):
            known = find_named(self.accounts.values(), row.name)
            if known is not None and known.account_id != row.account_id:
                raise NameTakenError(row.name)
            self.accounts[row.account_id] = row
        else:
            taken = find_named(self.tokens.values(), row.name)
            if taken is not None and taken.token_id != row.token_id:
                raise NameTakenError(row.name)
            self.tokens.pop(row.digest, None)
            if not change.gone:
                self.tokens[row.digest] = row
        for note in self.on_change:
            note(change)
        self.keep()

    def put(self, account: Account) -> None:
        """Keep a new state of an account, which is no change of rights."""
        self.accounts[account.account_id] = account
        self.keep()

    def open(self, session: Session) -> None:
        """Let a session begin; of too many the oldest ends."""
        known = self.sessions
        if len(known) >= MOST_SESSIONS:
            del known[min(known, key=lambda digest: known[digest].began)]
        self.sessions[session.key] = session
        self.keep()


_Row = TypeVar("_Row", Account, ApiToken)


def find_named(known: Iterable[_Row], name: str) -> _Row | None:
    """The person or program of this name, as people write it; None: nobody."""
    key = name_key(name)
    return next((row for row in known if name_key(row.name) == key), None)


SignOnFailure = Literal[
    "unreachable",
    "refused",
    "outdated",
    "untrusted",
    "no_role",
    "disabled",
    "busy",
]
"""Why a sign-in at the provider let nobody in: it did not answer, or said no; the
answer belongs to no sign-in that waits, or proves nothing; the person has no role here,
or is disabled here; too many sign in at once."""

_RANKS: Final[tuple[PersonRole, ...]] = ("viewer", "operator", "admin")


@dataclass(frozen=True, slots=True)
class ClaimReading:
    """Where name and role stand in a provider's claims.

    A path fits the shapes of the providers (docs/deployment.md, "Single sign-on"):
    ``realm_access.roles`` (Keycloak), ``roles`` or ``groups`` (Entra),
    ``roles[].name`` (lists of objects).

    Attributes:
        roles: Value of a claim → the role that it gives.
    """

    role_claim: str
    name_claim: str
    roles: Mapping[str, PersonRole]

    def read(self, issuer: str, subject: str, claims: Json) -> Account:
        """The account of the person whom claims are about, with the highest role.

        Args:
            issuer: Makes the claims.
            subject: Id of the person there.
            claims: What is told; of it nothing but strings counts.

        Raises:
            SignOnError: the claims give no role.
        """
        person = person_id(issuer, subject)
        claimed = next(values_at(claims, self.name_claim), "")
        values = values_at(claims, self.role_claim)
        given = {self.roles[value] for value in values if value in self.roles}
        role = max(given, key=_RANKS.index, default=None)
        name = name_of(claimed, person)
        if role is None:
            raise SignOnError("no_role", f"no value of the claim gives one to {name}")
        return Account(person, name, role, provider=issuer)


def person_id(issuer: str, subject: str) -> str:
    """Id of a person of a provider: neither their name nor the provider's address."""
    digest = hashlib.sha256(f"{issuer}\0{subject}".encode()).hexdigest()
    return f"sso-{digest[:32]}"


def name_of(claim: str, person: str) -> str:
    """A name that somebody may have, close to what is told; else part of the id."""
    kept = unicodedata.normalize("NFC", claim[: 4 * MOST_NAME])
    kept = "".join(
        character for character in kept if is_name(f"x{character}x")
    ).strip()[:MOST_NAME]
    return kept if is_name(kept := kept.strip()) else person[:12]


def another_name(name: str, person: str) -> str:
    """The name of somebody whose own is taken: with a part of the id behind it."""
    mark = f" {person.removeprefix('sso-')[:6]}"
    return f"{name[: MOST_NAME - len(mark)].rstrip()}{mark}"


def values_at(claims: Json, path: str) -> Iterator[str]:
    """Strings at a path, such as ``realm_access.roles`` or ``roles[].name``.

    A claim whose own name is the path, dots and all, comes first.
    """
    if path in claims:
        yield from _walk(claims[path], ())
    else:
        yield from _walk(claims, tuple(path.replace("[]", "").split(".")))


def _walk(value: object, path: tuple[str, ...]) -> Iterator[str]:
    if isinstance(value, list):
        for part in value:
            # Of a list inside a list nothing is read: no provider has one.
            if not isinstance(part, list):
                yield from _walk(part, path)
    elif path and isinstance(value, dict):
        yield from _walk(value.get(path[0]), path[1:])
    elif not path and isinstance(value, str):
        yield value
