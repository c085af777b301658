"""What the loop did and when, so that another pipeline can do it again.

Inputs are recorded byte for byte elsewhere.  What decides besides them is here: the
moments of the loop's steps and of the laser's looks on both clocks, every few seconds
the whole memory, and after each a hash of the world, which whoever plays the recording
must reach, too.
"""

from collections.abc import Callable, Iterator
from hashlib import blake2b
from typing import Final, Protocol

import orjson

from iveg.domain.observations import Instant, Received
from iveg.domain.records import CommandRecord, LogRecord, Record
from iveg.pipeline.steps import Step

KEYFRAMES_S, HASHED_AFTER_S = 2.0, 0.5
"""Between two memories, and from each to its hash (s).

Everybody waits while either is made: never for both at once.
"""
WALL_UNITS: Final = float(1 << 22)
"""Of a wall clock in one second: what a double of this century holds exactly."""
_NS = 10**9
_SOON_S = 0.25


class Trace:
    """Told what the pipeline does; this one forgets it."""

    def arrived(self, received: Received) -> None:
        """A copy of a message is about to be queued."""

    def stepped(self, now: Instant, kind: Step) -> None:
        """The loop takes a step of a kind."""

    def looked(self, now: Instant) -> None:
        """The second witness looks at a scan."""

    def sent(self) -> None:
        """How an order was sent has come back."""

    def ticked(self, now: Instant) -> None:
        """The loop has let time pass."""


class Recording(Protocol):
    """Where it is written down."""

    def note(self, name: str, payload: bytes, at: Instant) -> None:
        """JSON, by the name of its sort."""

    def memory(self, about: bytes, memory: Iterator[bytes], at: Instant) -> None:
        """A memory in pieces, which are made as they are taken, and JSON of it."""


class Chronicle(Trace):
    """Writes it down, once a tick.

    Args:
        recording: Takes it.
        version: Of the program.
        seed: Of ids; random.

    Attributes:
        remember: Gives the memory in pieces; None until there is a pipeline.
        picture: Gives the world as a page sees it.
        ids: Makes ids; they are the same where the same happens.
    """

    def __init__(self, recording: Recording, version: str, seed: bytes) -> None:
        self.remember: Callable[[], Iterator[bytes]] | None = None
        self.picture: Callable[[Instant], bytes] = lambda _: b""
        self.ids = CountedIds(seed)
        self._recording, self._version = recording, version
        self._steps: list[tuple[Instant, Step]] = []
        self._arrived: dict[float, tuple[float, int]] = {}
        self._kept_at = float("-inf")
        self._touched = self._is_hashed = False

    def arrived(self, received: Received) -> None:
        """Keep both clocks of it, and whether Orion leaves out others."""
        at = self.ids.now = received.at
        self._touched |= received.asked
        self._arrived[at.mono] = at.wall, received.thinned

    def heard(self, at: Instant) -> None:
        """Keep both clocks of what brings no observation, too."""
        self._arrived.setdefault(at.mono, (at.wall, 0))

    def looked(self, now: Instant) -> None:
        """Keep the look."""
        self.stepped(now, Step.LOOKED)

    def stepped(self, now: Instant, kind: Step) -> None:
        """Keep the step."""
        self.ids.now = now
        self._steps.append((now, kind))

    def sent(self) -> None:
        """No input: it is in the next memory."""
        self._touched = True

    def row(self, record: Record) -> None:
        """What people did is no input: it is in the next memory."""
        by_hand = isinstance(record, LogRecord) and "by" in record.slots
        self._touched |= by_hand or isinstance(record, CommandRecord)

    def ticked(self, now: Instant) -> None:
        """Write down what there is."""
        document = self._document(now)
        least = _SOON_S if self._touched else KEYFRAMES_S
        is_kept = now.mono - self._kept_at >= least - 1e-3
        is_old = now.mono - self._kept_at >= HASHED_AFTER_S - 1e-3
        if is_old and not (self._is_hashed or self._touched or is_kept):
            self._is_hashed = True
            document["hash"] = digest(self.picture(now))
        self._recording.note("Steps", orjson.dumps(document), now)
        if is_kept:
            self._keep(now)

    def _document(self, now: Instant) -> dict[str, object]:
        steps = [[*_apart(at, now), kind] for at, kind in self._steps]
        arrived = [
            [*_apart(Instant(mono, wall), now), int(thinned)]
            for mono, (wall, thinned) in self._arrived.items()
        ]
        self._steps.clear()
        self._arrived.clear()
        about = {"mono": in_ns(now.mono), "wall": now.wall, "ids": self.ids.count}
        return {**about, "steps": steps, "arrived": arrived}

    def _keep(self, now: Instant) -> None:
        if self.remember is None:
            return
        by_hand, self._kept_at = self._touched, now.mono
        self._touched = self._is_hashed = False
        document = {
            "version": self._version,
            "mono": in_ns(now.mono),
            "wall": now.wall,
            "by_hand": by_hand,
            "seed": self.ids.seed.hex(),
            "ids": self.ids.count,
        }
        self._recording.memory(orjson.dumps(document), self.remember(), now)


class CountedIds:
    """ULIDs whose random part is a hash of a seed and a count.

    Attributes:
        now: The moment that they carry.
        count: How many there were.
    """

    def __init__(self, seed: bytes) -> None:
        self.seed, self.count = seed, 0
        self.now = Instant(0.0, 0.0)

    def __call__(self) -> str:
        """The next one."""
        self.count += 1
        counted = self.count.to_bytes(8, "big")
        random = blake2b(counted, key=self.seed, digest_size=10).digest()
        number = int(self.now.wall * 1000) << 80 | int.from_bytes(random, "big")
        return "".join(_DIGITS[number >> shift & 31] for shift in range(125, -1, -5))


_DIGITS = "0123456789ABCDEFGHJKMNPQRSTVWXYZ"


def in_ns(mono: float) -> int:
    """A monotonic moment (s) in whole nanoseconds, as clocks count."""
    return round(mono * _NS)


def digest(picture: bytes) -> str:
    """The hash of a world."""
    return blake2b(picture, digest_size=16).hexdigest()


def _apart(at: Instant, now: Instant) -> tuple[int, int]:
    """How far from the tick: ns of the monotonic clock, and units of the wall clock."""
    return in_ns(at.mono) - in_ns(now.mono), round((at.wall - now.wall) * WALL_UNITS)
