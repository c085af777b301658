"""Programs that may call."""

from pydantic import Field

from iveg.domain.accounts import ApiToken, TokenScope
from iveg.domain.stamps import format_stamp
from iveg.models.base import Model, stamp


class ProgramToken(Model):
    """A program that may call, as admins see it."""

    token_id: str
    name: str
    scope: TokenScope
    made_at: str
    used_at: str | None = Field(description="The last time; null: never.")
    ends_at: str | None = Field(description="When it ends by itself; null: never.")
    over: bool = Field(description="It has ended by itself.")

    @classmethod
    def of(cls, token: ApiToken, now: float) -> "ProgramToken":
        """As it is at this moment (Unix s)."""
        return cls(
            token_id=token.token_id,
            name=token.name,
            scope=token.scope,
            made_at=format_stamp(token.made_at),
            used_at=stamp(token.used_at),
            ends_at=stamp(token.ends_at),
            over=not token.is_open(now),
        )


class NewToken(Model):
    """A program with its token, which is shown this once."""

    program: ProgramToken
    token: str
