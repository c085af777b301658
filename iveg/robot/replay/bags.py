"""ROS bags: odometry, scans and detections of recordings, placed by their TF."""

import logging
from collections.abc import Iterator
from contextlib import suppress
from datetime import UTC, datetime
from itertools import islice
from pathlib import Path
from typing import Any

from iveg.adapters import clock
from iveg.domain.errors import UnreadableError
from iveg.domain.geometry import Pose2D
from iveg.robot.replay.bag_files import BagFile, BagMessage
from iveg.robot.replay.bag_pass import BagPass, BagTree
from iveg.robot.replay.bag_plan import AS_RECORDED, BagOptions, BagPlan, Use
from iveg.robot.replay.logs import RecordingEntry
from iveg.ros2 import cdr, nav_msgs

__all__ = ["AS_RECORDED", "Bag", "BagOptions"]

_log = logging.getLogger(__name__)
_LONGEST_S = 1e7
_FUTURE_S = 86_400.0
_LINKS_AHEAD = 2000
"""Messages of TF that tell, before the first pass, which frames there are."""
_STAMPED = "odometry", "scan", "detections"


class Bag:
    """One recording of ROS, read from its start as often as asked, never held whole.

    Args:
        path: A file ``.db3``, ``.mcap`` or ``.bag``, or a directory of ROS 2.
        options: Topics and clock.
        mount: The laser's pose in ``base_link``, unless the bag has it.
        needs_odometry: Whether a bag without it is refused.

    Raises:
        DataFileError: it cannot be read, or its topics leave open which is meant.
        MissingExtraError: rosbags is not installed.
    """

    def __init__(
        self,
        path: Path,
        options: BagOptions,
        mount: Pose2D,
        *,
        needs_odometry: bool = True,
    ) -> None:
        self._file = BagFile(path)
        self.plan = plan = BagPlan(self._file, options)
        if not plan.has("odometry") and (
            needs_odometry or not plan.has("scan", "detections")
        ):
            raise self._file.unusable(f"holds no topic of type {nav_msgs.Odometry.ROS}")
        self._mount = mount
        self._reported: set[str] = set()
        self._tree = self._look_ahead()
        # Stamps count unless the first message has none: a bag uses one of the two
        # clocks throughout, since they may differ by years.
        first = next(self._messages(*_STAMPED), None)
        stamp = 0.0 if first is None else first[1].header.stamp.seconds
        self._bag_time = options.bag_time or (first is not None and stamp <= 0.0)
        if first is not None:
            self._tell_future(first[0].logged_s if self._bag_time else stamp)

    def entries(self) -> Iterator[RecordingEntry]:
        """All entries, in the order in which they were recorded.

        A message that cannot be used is skipped and counted; the first of a topic is
        reported, and one with an absurd stamp is omitted.

        Raises:
            DataFileError: the recording breaks off.
        """
        this = BagPass(self.plan.read, self._tree, self._mount)
        start: float | None = None
        look_at = 0.0
        for recorded, use in self._records():
            try:
                message = self._read(recorded, use)
                found = this.observe(use, message, recorded.logged_s)
            except UnreadableError as error:
                this.losses[recorded.topic, error.reason] += 1
                self._report(recorded, str(error))
                continue
            at = self._time(recorded, message)
            if use.role in _STAMPED:
                start = at if start is None else start
            if use.role == "detections":
                look_at = at
            if found is None:
                found, at = this.late_frame(recorded.logged_s), look_at
            if (
                found is not None
                and start is not None
                and abs(at - start) <= _LONGEST_S
            ):
                yield RecordingEntry(at - start, found)
        self._tell_counts(this)

    def _time(self, recorded: BagMessage, message: object) -> float:
        header = getattr(message, "header", None)
        if self._bag_time or header is None:
            return recorded.logged_s
        return float(header.stamp.seconds)

    # --- its messages -------------------------------------------------------------

    def _records(self, *roles: str) -> Iterator[tuple[BagMessage, Use]]:
        """Messages of topics with these roles; without, of all that are read."""
        uses = {
            name: use
            for name, use in self.plan.read.items()
            if not roles or use.role in roles
        }
        for recorded in self._file.messages([one.topic for one in uses.values()]):
            yield recorded, uses[recorded.topic]

    def _messages(self, *roles: str) -> Iterator[tuple[BagMessage, Any]]:
        """Those of them that can be read."""
        for recorded, use in self._records(*roles):
            with suppress(UnreadableError):
                yield recorded, self._read(recorded, use)

    def _read(self, recorded: BagMessage, use: Use) -> object:
        return cdr.read(use.form, recorded.payload)

    def _look_ahead(self) -> BagTree:
        """Which frames the bag has."""
        static = [one for _, one in self._messages("tf_static")]
        moving = [one for _, one in islice(self._messages("tf"), _LINKS_AHEAD)]
        _, odometry = next(self._messages("odometry"), (None, None))
        return BagTree(static, moving, odometry)

    # --- what is told -------------------------------------------------------------

    def _report(self, recorded: BagMessage, why: str) -> None:
        if recorded.topic in self._reported:
            return
        self._reported.add(recorded.topic)
        _log.warning(
            "%s, %s: unusable messages are skipped, such as at %d ns: %s",
            self._file.path,
            recorded.topic,
            round(recorded.logged_s * 1e9),
            why,
        )

    def _tell_future(self, start: float) -> None:
        if start > clock.wall() + _FUTURE_S:
            day = datetime.fromtimestamp(min(start, 2.5e11), UTC).date()
            _log.warning(
                "%s is of %s, which is still to come: it plays by the differences.",
                self._file.path,
                day,
            )

    def _tell_counts(self, this: BagPass) -> None:
        """What became of each topic's messages; one that gave nothing is no detail."""
        for topic, count in sorted(this.used.items()):
            _log.info("%s, %s: %d used", self._file.path, topic, count)
        for (topic, why), count in sorted(this.losses.items()):
            level = logging.INFO if this.used[topic] else logging.WARNING
            slots = self._file.path, topic, count, why
            _log.log(level, "%s, %s: %d not used: %s", *slots)
