"""Trials of a rule: an operator begins, ends and promotes them."""

import asyncio
from dataclasses import replace
from typing import Final

from iveg.comfort.shadow import ShadowRule
from iveg.domain.detection_rule import DetectionRule
from iveg.domain.errors import TrialRefusedError
from iveg.domain.observations import Instant
from iveg.domain.rule.trial import Trial
from iveg.vital.evaluate import Evaluator
from iveg.vital.ports import ChoiceStore, Clock
from iveg.vital.rules import Rules

SAVED_EVERY_S: Final = 30.0


class Trials:
    """Begins, ends and promotes trials by an operator's word.

    Args:
        store: Keeps the trial for the next start of iVeg.
        kept: What the last run left.
    """

    def __init__(
        self,
        shadow: ShadowRule,
        evaluator: Evaluator,
        rules: Rules,
        store: ChoiceStore[Trial | None],
        kept: Trial | None,
        clock: Clock,
    ) -> None:
        self._shadow, self._evaluator, self._rules = shadow, evaluator, rules
        self._store, self._clock = store, clock
        self._one_by_one = asyncio.Lock()
        if kept is not None:
            shadow.begin(kept, evaluator, clock())

    @property
    def current(self) -> Trial | None:
        """The trial as it stands; None: nothing is tried."""
        return self._shadow.trial()

    async def begin(self, wanted: DetectionRule, by: str, at: Instant) -> Trial:
        """Try a candidate.

        Raises:
            TrialRefusedError: another is tried, or it is the version in force.
            HopError: it could not be written down; nothing is tried.
        """
        async with self._one_by_one:
            if self.current is not None:
                raise TrialRefusedError("running")
            if is_same(wanted, self._rules.current):
                raise TrialRefusedError("same")
            trial = Trial(replace(wanted, author=by, since=None), by, at.wall)
            await self._store.save(trial)
            self._shadow.begin(trial, self._evaluator, at)
            return trial

    async def end(self) -> Trial:
        """End the trial; returns it as it stood.

        Raises:
            TrialRefusedError: nothing is tried.
            HopError: it could not be written down; the trial goes on.
        """
        async with self._one_by_one:
            trial = self._running()
            await self._store.save(None)
            self._shadow.end()
            return trial

    async def promote(self, by: str, at: Instant, seen: int) -> DetectionRule:
        """Put the candidate in force, with what came of the trial; that ends.

        Raises:
            TrialRefusedError: nothing is tried.
            OutdatedError: another version is in force than was seen.
            HopError: it could not be written down; the old version stays in force.
        """
        async with self._one_by_one:
            trial = self._running()
            wanted = replace(trial.rule, comparison=trial.so_far)
            rule = await self._rules.change(wanted, by, at, seen)
            self._shadow.end()
            await self._store.save(None)
            return rule

    def _running(self) -> Trial:
        trial = self.current
        if trial is None:
            raise TrialRefusedError("none")
        return trial

    async def run(self) -> None:
        """Write down what came of a trial now and then, until cancelled."""
        while True:
            await asyncio.sleep(SAVED_EVERY_S)
            await self.save()

    async def save(self) -> None:
        """Write down what came of the trial so far.  Raises HopError."""
        async with self._one_by_one:
            if (trial := self.current) is not None:
                await self._store.save(trial)


def is_same(one: DetectionRule, other: DetectionRule) -> bool:
    """Whether two versions judge alike."""
    return _judges(one) == _judges(other)


def _judges(rule: DetectionRule) -> DetectionRule:
    """A version without what judges nothing."""
    return replace(rule, id="", version=0, author="", since=None, comparison=None)
