"""The desired state of a robot in an earlier run of iVeg, as the disk remembers it."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class DesiredRecord:
    """A robot that was to stand.

    Attributes:
        by: Who asked.
        hold_id: The hold of that STOP; None where the disk does not know whether a
            release has named it.
        named: Holds that any release ever named, the last 64, newest last.
        asked: STOPs that the newest release named, if nothing has confirmed it.
        challenge: The challenge which that release carried.
    """

    by: str
    hold_id: str | None = None
    named: tuple[str, ...] = ()
    asked: tuple[str, ...] = ()
    challenge: str | None = None
