"""Access: accounts, tokens of programs, sessions, and claims of providers.

The name of a person goes with each STOP through Orion.  Orion refuses an
update that has certain characters, so a STOP by that transport would fail for such a
name.  All of this is in memory while iVeg runs, so a missing, slow or damaged disk
or database does not change who may stop.
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
"""Proof of an identity: ``sso`` by an identity provider, ``token`` of a program."""
ACCOUNT_METHODS: Final = frozenset({"password", "sso"})
"""Methods of people with an account, by which their sessions end."""
PersonRole = Literal["viewer", "operator", "admin"]
AccountState = Literal["active", "invited", "over", "disabled"]
"""``over``: its time has ended."""
TokenScope = Literal["read", "stop", "operate"]
"""Rights of a program, each with those before it; ``operate``: all of an operator."""

LINK_PERSON: Final = "link"
"""Id of the person who uses the link of the environment."""
DEFAULT_NAME: Final = "operator"
"""Name of that person without a setting."""
MOST_NAME: Final = 64
"""Greatest length of a name (characters)."""
_REFUSED: Final = frozenset("<>\"'=;()")
_RESERVED: Final = frozenset(
    {"console", "iveg", "link", "nobody", "program", DEFAULT_NAME}
)


def is_name(text: str) -> bool:
    """Whether a text may be a name: short, visible, and accepted by Orion."""
    return (
        0 < len(text) <= MOST_NAME
        and text == unicodedata.normalize("NFC", text).strip()
        and _REFUSED.isdisjoint(text)
        and not any(unicodedata.category(character)[0] == "C" for character in text)
    )


def is_reserved(name: str) -> bool:
    """Whether the log uses a name for an actor without an account, such as iVeg."""
    return name_key(name) in _RESERVED


def name_key(name: str) -> str:
    """Key that two names may not share, without case and width of characters."""
    return unicodedata.normalize("NFKC", name).casefold().strip()


def digest_of(secret: str) -> str:
    """SHA-256 (hex) of an invitation or a token; nothing else of it is stored."""
    return hashlib.sha256(secret.encode()).hexdigest()


@dataclass(frozen=True, slots=True)
class Account:
    """A person who may sign in.

    Attributes:
        account_id: Id, never used again; a name may be.
        name: Name of the person.
        role: Role of the person.
        password: Hash (PHC string format); empty until the invitation is accepted.
        disabled: Whether an admin closed it.
        ends_at: Time at which it closes by itself (Unix s); None: never.
        invitation: SHA-256 of the open invitation (hex); empty: there is none.
        invited_until: Time at which the invitation ends (Unix s).
        since: Last change of role or password (Unix s), which ended all sessions.
        provider: Issuer that identifies the person and gives the role; empty: none.
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
        """Whether the account is open at this moment (Unix s)."""
        return not self.disabled and (self.ends_at is None or now < self.ends_at)

    def state(self, now: float) -> AccountState:
        """State of the account at this moment (Unix s)."""
        if not self.is_open(now):
            return "disabled" if self.disabled else "over"
        return "active" if self.password or self.provider else "invited"


@dataclass(frozen=True, slots=True)
class ApiToken:
    """A program with a token, of which only the digest is stored.

    Attributes:
        token_id: Id of the token.
        name: Name of the program.
        scope: Rights of the program.
        digest: SHA-256 of the token (hex).
        made_at: Time of its making (Unix s).
        used_at: Last use, to a minute (Unix s); None: never used.
        ends_at: Time at which it ends by itself (Unix s); None: never.
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
        name: Name of the person.
        role: Role at the sign-in.
        began: Time of the sign-in (Unix s).
        person: Id of the account; empty in sessions of earlier versions.
        method: Method of the sign-in.
    """

    digest: str
    name: str
    role: PersonRole
    began: float
    person: str = ""
    method: SignInMethod = "link"

    @property
    def session_id(self) -> str:
        """Id for display: it does not give the digest away, and opens nothing."""
        return digest_of(f"id:{self.digest}")[:16]


@dataclass(frozen=True, slots=True)
class Access:
    """Accounts, tokens and sessions at one moment."""

    accounts: tuple[Account, ...] = ()
    tokens: tuple[ApiToken, ...] = ()
    sessions: tuple[Session, ...] = ()


MOST_SESSIONS: Final = 1000
"""Greatest number of sessions in memory; one more ends the oldest."""


@dataclass(frozen=True, slots=True)
class AccessChange:
    """A change of rights, as in the audit.

    Attributes:
        action: Key of the action in the audit.
        row: The account or token after the change.
        details: Details for the audit.
        gone: Whether the token is deleted.
        by: The person who changed it.
    """

    action: str
    row: Account | ApiToken
    details: Json = field(default_factory=dict)
    gone: bool = False
    by: Actor = CONSOLE


class AccessBook:
    """Accounts by id, tokens and sessions by digest (hex).

    Attributes:
        accounts: Accounts by id.
        tokens: Tokens by digest (hex).
        sessions: Sessions by digest.
        on_change: Called after each change of rights.
        on_keep: Called when something is to be stored; they return at once.
    """

    def __init__(self, kept: Access = Access()) -> None:
        self.accounts = {account.account_id: account for account in kept.accounts}
        self.tokens = {token.digest: token for token in kept.tokens}
        self.sessions = {session.digest: session for session in kept.sessions}
        self.on_change: list[Callable[[AccessChange], None]] = []
        self.on_keep: list[Callable[[], None]] = []

    def picture(self) -> Access:
        """Accounts, tokens and sessions at this moment."""
        return Access(
            tuple(self.accounts.values()),
            tuple(self.tokens.values()),
            tuple(self.sessions.values()),
        )

    def keep(self) -> None:
        """Have the present state stored."""
        for keep in self.on_keep:
            keep()

    def add(self, earlier: Access) -> None:
        """Add entries of an earlier state that are not known yet."""
        # The right side of a union wins: the present state.
        before = AccessBook(earlier)
        self.accounts = before.accounts | self.accounts
        self.tokens = before.tokens | self.tokens
        self.sessions = before.sessions | self.sessions
        self.keep()

    def apply(self, change: AccessChange) -> None:
        """Apply a change; it counts from the next request of each session.

        Raises:
            NameTakenError: another person or program has the name.
        """
        row = change.row
        if isinstance(row, Account):
            known = find_named(self.accounts.values(), row.name)
            if known is not None and known.account_id != row.account_id:
                raise NameTakenError(row.name)
            self.accounts[row.account_id] = row
        else:
            holder = find_named(self.tokens.values(), row.name)
            if holder is not None and holder.token_id != row.token_id:
                raise NameTakenError(row.name)
            self.tokens.pop(row.digest, None)
            if not change.gone:
                self.tokens[row.digest] = row
        for note in self.on_change:
            note(change)
        self.keep()

    def put(self, account: Account) -> None:
        """Store a new state of an account that changes no rights."""
        self.accounts[account.account_id] = account
        self.keep()

    def open(self, session: Session) -> None:
        """Open a session; one too many ends the oldest."""
        known = self.sessions
        if len(known) >= MOST_SESSIONS:
            del known[min(known, key=lambda digest: known[digest].began)]
        self.sessions[session.digest] = session
        self.keep()


_Row = TypeVar("_Row", Account, ApiToken)


def find_named(known: Iterable[_Row], name: str) -> _Row | None:
    """The account or token with a name, by its key; None: there is none."""
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
"""Reasons why a sign-in at the provider failed.

The provider did not answer, or refused; the answer belongs to no open sign-in, or its
proof is wrong; the person has no role here, or is disabled; too many sign in at once.
"""

_RANKS: Final[tuple[PersonRole, ...]] = ("viewer", "operator", "admin")


@dataclass(frozen=True, slots=True)
class ClaimReading:
    """Paths of name and role in the claims of a provider.

    A path fits the shapes of the providers (docs/deployment.md, "Single sign-on"):
    ``realm_access.roles`` (Keycloak), ``roles`` or ``groups`` (Entra),
    ``roles[].name`` (lists of objects).

    Attributes:
        role_claim: Path of the role.
        name_claim: Path of the name.
        roles: Value of the claim → role.
    """

    role_claim: str
    name_claim: str
    roles: Mapping[str, PersonRole]

    def read(self, issuer: str, subject: str, claims: Json) -> Account:
        """The account of the person in the claims, with the highest role.

        Args:
            issuer: Issuer of the claims.
            subject: Id of the person at the issuer.
            claims: The claims, of which only strings count.

        Raises:
            SignOnError: the claims give no role.
        """
        person = person_id(issuer, subject)
        claimed = next(values_at(claims, self.name_claim), "")
        values = values_at(claims, self.role_claim)
        roles = {self.roles[value] for value in values if value in self.roles}
        role = max(roles, key=_RANKS.index, default=None)
        name = name_of(claimed, person)
        if role is None:
            raise SignOnError("no_role", f"no value of the claim gives one to {name}")
        return Account(person, name, role, provider=issuer)


def person_id(issuer: str, subject: str) -> str:
    """Id of a person at a provider; it shows neither name nor address."""
    return "sso-" + digest_of(f"{issuer}\0{subject}")[:32]


def name_of(claim: str, person: str) -> str:
    """The claimed name, without refused characters; else a part of the id."""
    text = unicodedata.normalize("NFC", claim[: 4 * MOST_NAME])
    # Between letters, since a blank alone or at an end is no name.
    allowed = "".join(character for character in text if is_name(f"x{character}x"))
    name = allowed.strip()[:MOST_NAME].strip()
    return name if is_name(name) else person[:12]


def another_name(name: str, person: str) -> str:
    """A name that is taken, with a part of the id behind it."""
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
            # A list inside a list is not read: no provider has one.
            if not isinstance(part, list):
                yield from _walk(part, path)
    elif path and isinstance(value, dict):
        yield from _walk(value.get(path[0]), path[1:])
    elif not path and isinstance(value, str):
        yield value
