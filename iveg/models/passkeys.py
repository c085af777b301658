"""Passkeys, and whether a release asks for one."""

from pydantic import Field

from iveg.domain.passkeys import Passkey
from iveg.domain.stamps import format_stamp
from iveg.models.base import Model, stamp


class PasskeyOfPerson(Model):
    """A passkey of whoever asks."""

    passkey_id: str
    name: str = Field(description="What the person calls it.")
    host: str = Field(description="The address it works at.")
    made_at: str
    used_at: str | None = Field(description="Null: never.")

    @classmethod
    def of(cls, passkey: Passkey) -> "PasskeyOfPerson":
        """As it is kept."""
        return cls(
            passkey_id=passkey.credential_id,
            name=passkey.name,
            host=passkey.rp_id,
            made_at=format_stamp(passkey.made_at),
            used_at=stamp(passkey.used_at),
        )


class Proof(Model):
    """Whether a release would ask whoever asks to prove anew who they are."""

    needed: bool
    until: str | None = Field(description="When it would; null: never.")
    ways: list[str] = Field(description="`password`, `passkey`, `pin`, `sso`.")

    @classmethod
    def of(cls, until: float | None, ways: list[str], *, needed: bool) -> "Proof":
        """With the end of the proof before (Unix s)."""
        return cls(needed=needed, until=stamp(until), ways=ways)
