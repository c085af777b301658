"""Earlier desired state of a robot: of an earlier run, or of an earlier STOP."""

from dataclasses import dataclass

from iveg.domain.limits import LIMITS


@dataclass(frozen=True, slots=True)
class Kept:
    """An existing hold of the robot that a new STOP asserts again.

    Attributes:
        hold_id: None: the STOP is a new hold.
        challenge: Of a release that may still lift it.
    """

    hold_id: str | None = None
    challenge: str | None = None


NEW_HOLD = Kept()


@dataclass(frozen=True, slots=True)
class DesiredRecord:
    """The stored desire that a robot stands.

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

    def hold_to_assert(self) -> Kept:
        """The hold that a STOP after a restart asserts again.

        A hold that no release ever named cannot have been lifted, so asserting it again
        adds none.  One that was named may have been: the robot would answer RELEASED
        and hold nothing, so the hold is a new one; unless there are so many that
        theirs is asserted until the robot's word, or its silence, decides.
        """
        if self.hold_id in self.named:
            many = len(self.asked) >= LIMITS.most_holds
            return Kept(self.hold_id, self.challenge) if many else NEW_HOLD
        return Kept(self.hold_id)
