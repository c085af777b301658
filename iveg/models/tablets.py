"""Shared tablets, and who may unlock them."""

from pydantic import Field

from iveg.domain.accounts import PersonRole
from iveg.models.base import Model


class TabletPerson(Model):
    """Somebody who may unlock a shared tablet."""

    person_id: str
    name: str
    blocked_s: int = Field(description="How long their PIN is refused; 0: not at all.")


class Tablet(Model):
    """A shared tablet as it is now."""

    name: str
    holder: str | None = Field(description="Who has unlocked it; null: it is locked.")
    role: PersonRole = Field(description="What may be done on it now.")
    left_s: float = Field(description="Until it locks by itself if nothing is done.")
    people: list[TabletPerson]
