"""The latency watch in the loop: messages in, minutes and log lines out."""

from collections.abc import Iterable, Sequence

from iveg.domain.errors import UnreadableError
from iveg.domain.events import LogEvent
from iveg.domain.latency.overloads import Remark
from iveg.domain.latency.segments import DATA, SEGMENTS, Data, Segment
from iveg.domain.latency.sketch import Sketch, merged, read_bins, write_bins
from iveg.domain.latency.watch import LatencyWatch, Measured
from iveg.domain.observations import Instant
from iveg.domain.records import LatencyRecord
from iveg.pipeline.event_log import EventLog
from iveg.pipeline.record import RecordSink

_QUIET_S = 10.0
"""A hop that falls behind again within this is the same story."""


class LatencyMonitor:
    """Hands the findings of the watch to history and log.

    Attributes:
        watch: Where the time goes.
    """

    def __init__(
        self, watch: LatencyWatch, sink: RecordSink, event_log: EventLog
    ) -> None:
        self.watch = watch
        self._sink = sink
        self._event_log = event_log
        self._logged_at: dict[str, float] = {}

    def tick(self, now: Instant) -> None:
        """Let time pass."""
        self.watch.tick(now)
        for began_at, minute in self.watch.ended:
            self._sink.enqueue(_record(began_at, minute))
        self.watch.ended.clear()
        for remark in self.watch.overloads.remarks:
            self._tell(remark, now)

    def _tell(self, remark: Remark, now: Instant) -> None:
        """Log a remark once, for as long as it lasts."""
        what = "behind" if remark.what == "growing" else remark.what
        about = f"{what}/{remark.hop}/{remark.slots.get('robot', '')}"
        last = self._logged_at.get(about, float("-inf"))
        self._logged_at[about] = now.mono
        if now.mono - last > _QUIET_S:
            robot = remark.slots.get("robot")
            event = LogEvent(
                "system",
                f"log.{what}.{remark.hop}",
                remark.slots,
                None if robot is None else str(robot),
            )
            self._event_log.log(event, now)


def hours_of(kept: Sequence[LatencyRecord]) -> list[Measured]:
    """Minutes of the history, oldest first, as hours; pure, so any thread may do it."""
    hours: dict[tuple[int, str, Data, Segment], list[Sketch]] = {}
    for record in kept:
        for robot_id, data, hop, sketch in _minute(record):
            place = int(record.at // 3600.0), robot_id, data, hop
            hours.setdefault(place, []).append(sketch)
    return [
        (robot_id, data, hop, merged(minutes))
        for (_, robot_id, data, hop), minutes in hours.items()
    ]


def _record(began_at: float, minute: Measured) -> LatencyRecord:
    robot_id, data, hop, sketch = minute
    return LatencyRecord(
        at=began_at,
        robot_id=robot_id,
        data=data,
        hop=hop,
        count=sketch.count,
        total_s=sketch.total,
        least_s=sketch.least,
        most_s=sketch.most,
        bins=write_bins(sketch),
    )


def _minute(record: LatencyRecord) -> Iterable[Measured]:
    """The minute of a row; none where a later version named what this one lacks."""
    data = next((one for one in DATA if one == record.data), None)
    hop = next((one for one in SEGMENTS if one == record.hop), None)
    if data is None or hop is None:
        return
    try:
        keys, counts = read_bins(record.bins)
    except UnreadableError:
        return
    sketch = Sketch(
        record.count, record.total_s, record.least_s, record.most_s, keys, counts
    )
    yield record.robot_id, data, hop, sketch
