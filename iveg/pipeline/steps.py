"""Kinds of steps that the rule loop takes, and the second witness beside it."""

from enum import IntEnum


class Step(IntEnum):
    """What a step does, by the number that recordings keep."""

    TAKEN = 0
    """It only takes what has arrived."""
    JUDGED = 1
    """It judges the fleet as well, and lets time pass if that is due."""
    LOOKED = 2
    """The second witness looked at a scan."""
    AGED = 3
    """Nothing but time passes for the world."""
