"""Changes of the rule: a new version, on disk first, in force at once, logged."""

import asyncio
from collections.abc import Iterable, Iterator
from dataclasses import replace

from iveg.domain.detection_rule import DetectionRule
from iveg.domain.errors import OutdatedError
from iveg.domain.events import LogEvent, Slot
from iveg.domain.observations import Instant
from iveg.domain.parameters import CLASSES, PARAMETERS, for_class
from iveg.vital.evaluate import Evaluator
from iveg.vital.event_log import EventLog
from iveg.vital.ports import RuleStore


class Rules:
    """The versions of the rule; the newest is the one in force.

    Attributes:
        versions: All of them, oldest first.
    """

    def __init__(
        self,
        evaluator: Evaluator,
        store: RuleStore,
        event_log: EventLog,
        past: Iterable[DetectionRule],
    ) -> None:
        self._evaluator = evaluator
        self._store = store
        self._event_log = event_log
        self._one_by_one = asyncio.Lock()
        self.versions = [*past] or [evaluator.rule]

    @property
    def current(self) -> DetectionRule:
        """The version in force."""
        return self._evaluator.rule

    async def change(
        self, wanted: DetectionRule, by: str, at: Instant, seen: int | None = None
    ) -> DetectionRule:
        """Put new parameters in force under the next version.

        Args:
            wanted: The parameters; its version, author and time are not looked at.
            by: Who wants it.
            at: When.
            seen: The version that they have changed; None does not ask.

        Raises:
            OutdatedError: somebody else was faster.
            HopError: it could not be written down; the old version stays in force.
        """
        async with self._one_by_one:
            before = self.current
            if seen is not None and seen != before.version:
                raise OutdatedError("The rule", seen, before.version)
            rule = replace(
                wanted,
                id=before.id,
                version=before.version + 1,
                author=by,
                since=at.wall,
            )
            await self._store.append(rule)
            self._evaluator.rule = rule
            self.versions.append(rule)
        for line in _lines(before, rule):
            self._event_log.rule(line, at)
        return rule


def _lines(before: DetectionRule, rule: DetectionRule) -> Iterator[LogEvent]:
    """The change, then each value of a class that is another now."""
    slots: dict[str, Slot] = {"by": rule.author, "version": rule.version}
    yield LogEvent("system", "log.rule_changed", slots)
    for class_ in CLASSES:
        earlier = for_class(before, class_)
        for row in PARAMETERS:
            value = for_class(rule, class_)[row.name]
            one_for_all = row.class_key is None and class_ != CLASSES[0]
            if value == earlier[row.name] or one_for_all:
                continue
            changed: dict[str, Slot] = {
                "parameter": row.word,
                "class": "every" if row.class_key is None else class_,
                "from": float(earlier[row.name]),
                "to": float(value),
            }
            yield LogEvent("system", f"log.rule.{row.unit}", changed)
