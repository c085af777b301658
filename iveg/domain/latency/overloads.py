"""Overload, one sentence for each hop: how far it is behind and how much it loses.

It is read once a second from the newest messages at each hop, so that a hop that falls
behind is named within three seconds: by the messages that still wait at it, before any
late one has come out.
"""

from collections import deque
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from statistics import median
from typing import Final, Literal

from iveg.domain.latency.segments import Segment
from iveg.domain.latency.sequence_loss import SequenceLoss
from iveg.domain.latency.stream import Stream

BEHIND_S: Final = 1.0
"""What is later is behind; half of it again and it has caught up."""
LOST_SHARE: Final = 0.05
_LEAST_LOST = 3
_LEAST_REORDERED = 3
_FRESH_S: Final = 2.0
_GROWS_S, _GROWS_WITHIN = 0.25, 4
"""Later by so much than that many seconds before."""


@dataclass(frozen=True, slots=True)
class Remark:
    """One finding about a hop, for people.

    Attributes:
        what: ``growing`` is behind and ever more so.
        slots: Fill its sentence.
    """

    what: Literal["behind", "growing", "lost", "reordered"]
    hop: Segment
    slots: Mapping[str, str | float]

    @property
    def key(self) -> str:
        """Name of its sentence."""
        return f"latency.{self.what}.{self.hop}"


class Overloads:
    """Findings about the hops now, once a second.

    Attributes:
        remarks: In sentences.
        lags: How far each is behind, by hop and robot (s); no robot where all share it.
    """

    def __init__(self) -> None:
        self.remarks: Sequence[Remark] = ()
        self.lags: dict[tuple[Segment, str], float] = {}
        self._lags: dict[tuple[Segment, str], deque[float]] = {}
        self._behind: set[tuple[Segment, str]] = set()

    def update(self, streams: Sequence[Stream], now: float) -> None:
        """Judge the hops by their newest messages (``now`` monotonic, s)."""
        found: list[Remark] = []
        robots = sorted({one.robot_id for one in streams})
        for robot_id in robots:
            own = [one for one in streams if one.robot_id == robot_id]
            found += self._lag("uplink", robot_id, _newest(own, "uplink", now))
        agent = [_behind_agent(one, now) for one in streams]
        late = [lag for lag in agent if lag is not None]
        found += self._lag("fiware", "", median(late) if late else None)
        found += self._lag("iveg", "", _newest(streams, "iveg", now))
        found += self._lag("screen", "", _newest(streams, "screen", now))
        for stream in streams:
            found += _disorder(stream)
        self.remarks = tuple(found)

    def _lag(
        self, hop: Segment, robot_id: str, lag_s: float | None
    ) -> Iterable[Remark]:
        about = hop, robot_id
        if lag_s is None:
            self._lags.pop(about, None)
            self.lags.pop(about, None)
            self._behind.discard(about)
            return
        past = self._lags.setdefault(about, deque(maxlen=_GROWS_WITHIN))
        grows = bool(past) and lag_s > past[0] + _GROWS_S
        past.append(lag_s)
        self.lags[about] = lag_s
        limit = BEHIND_S / 2 if about in self._behind else BEHIND_S
        if lag_s < limit:
            self._behind.discard(about)
            return
        self._behind.add(about)
        slots: dict[str, str | float] = {"lag": round(lag_s, 1)}
        if robot_id:
            slots["robot"] = robot_id
        yield Remark("growing" if grows else "behind", hop, slots)


def _newest(streams: Sequence[Stream], hop: Segment, now: float) -> float | None:
    """The least of what its streams took last (s): what one is late for is not all."""
    fresh = (
        series.newest
        for series in (one.segments[hop] for one in streams)
        if now - series.newest_at <= _FRESH_S
    )
    return min(fresh, default=None)


def _behind_agent(stream: Stream, now: float) -> float | None:
    """How far FIWARE is behind with one stream (s); None where nothing tells."""
    waiting, series = stream.waiting_s(now), stream.segments["fiware"]
    fresh = series.newest if now - series.newest_at <= _FRESH_S else None
    known = [one for one in (waiting, fresh) if one is not None]
    return max(known, default=None)


def _disorder(stream: Stream) -> Iterable[Remark]:
    about = {"robot": stream.robot_id, "data": stream.data}
    hops: tuple[tuple[Segment, SequenceLoss], ...] = (
        ("uplink", stream.up),
        ("fiware", stream.fiware),
    )
    for hop, order in hops:
        lately = order.lately
        if lately.missing >= _LEAST_LOST and lately.lost_share >= LOST_SHARE:
            share = round(lately.lost_share, 2)
            yield Remark("lost", hop, {**about, "share": share})
        if lately.reordered >= _LEAST_REORDERED:
            count = lately.reordered
            yield Remark("reordered", hop, {**about, "count": count})
