"""When each message was stamped, at the broker and at Orion."""

from collections.abc import Iterable
from dataclasses import dataclass, field

from iveg.domain.latency.segments import DATA, LONGEST_S, STAMP_S, Data, Segment

COUNTS = ("sent", "lost", "reordered", "orion_first")


@dataclass(frozen=True, slots=True)
class MessageTimes:
    """One message at the places that it passed, all by one clock (Unix s).

    Two are equal if they are of one message.

    Attributes:
        stamp: As the robot stamped it; None: it did not.
        broker: When the broker had passed it on.
        orion: When Orion's notification was here; None: it never came.
    """

    robot_id: str
    data: Data
    boot: str
    seq: int
    stamp: float | None = field(compare=False)
    broker: float = field(default=0.0, compare=False)
    orion: float | None = field(default=None, compare=False)

    @property
    def hops(self) -> dict[Segment, float] | None:
        """Δt₁, Δt₂ and their sum (s); None where Orion's copy was first or never came.

        What was stamped later than it came, or a minute before, does not count.
        """
        if self.stamp is None or self.orion is None:
            return None
        up, on = self.broker - self.stamp, self.orion - self.broker
        if on < 0.0 or not -STAMP_S <= up <= LONGEST_S:
            return None
        up = max(0.0, up)
        return {"uplink": up, "fiware": on, "robot_orion": up + on}


def counts_of(times: Iterable[MessageTimes]) -> dict[Data, dict[str, int]]:
    """Messages at the broker; of these lost, out of order, or first at Orion."""
    counts = {data: dict.fromkeys(COUNTS, 0) for data in DATA}
    came = []
    for one in times:
        count = counts[one.data]
        count["sent"] += 1
        if one.orion is None:
            count["lost"] += 1
        else:
            count["orion_first"] += one.orion < one.broker
            came.append((one.orion, one))
    newest: dict[tuple[str, Data, str], int] = {}
    for _, one in sorted(came, key=lambda each: each[0]):
        stream = one.robot_id, one.data, one.boot
        counts[one.data]["reordered"] += one.seq < newest.get(stream, one.seq)
        newest[stream] = max(one.seq, newest.get(stream, one.seq))
    return counts
