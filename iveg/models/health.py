"""Whether the data path from robot to screen is whole, and how soon robots obey."""

from typing import Literal

from pydantic import Field

from iveg.models.base import Model
from iveg.models.safety import Safety


class HopHealth(Model):
    """One hop of the data path from robot to screen."""

    hop: str
    state: Literal["ok", "late", "down", "unknown"]
    age_s: float | None
    key: str
    detail: str
    lag_s: float | None = Field(description="How late measures pass it, at least.")
    growing: bool


class Health(Model):
    """State of the data path, counters, and reaction times of the fleet."""

    ok: bool
    hops: list[HopHealth]
    counters: dict[str, int]
    safety: Safety
    earlier: Literal["known", "reading", "unknown"] = Field(
        description="State of the records of earlier runs."
    )
