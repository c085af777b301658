"""Every version of the rule, in a small file of JSON lines that is replaced as a whole.

The settings make the first version.  What a person changed outlives a restart, until
somebody changes the settings themselves: then these are the newer word, and a version
of their own.
"""

import asyncio
import os
from collections.abc import Sequence
from dataclasses import asdict, replace
from pathlib import Path

import orjson

from iveg.domain.alerts import Rule
from iveg.domain.errors import DataFileError, HopError
from iveg.domain.limits import LIMITS
from iveg.domain.observations import Instant

_SETTINGS = "settings"


class FileRules:
    """The rule's versions in one file; implements ``pipeline.ports.RuleStore``."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._versions: list[Rule] = []

    def load(self, settings: Rule, now: Instant) -> Sequence[Rule]:
        """All versions, oldest first; the last is to be in force.

        Args:
            settings: The rule as the settings have it.
            now: When settings that differ from those of last time began to count.

        Raises:
            DataFileError: a line that is no version of the rule.
        """
        self._versions = self._read() or [settings]
        last = self._versions[-1]
        told = [rule for rule in self._versions if rule.author == _SETTINGS]
        if not told or not _agree(told[-1], settings):
            changed = replace(
                last,
                threshold=settings.threshold,
                radius_m=settings.radius_m,
                version=last.version + 1,
                author=_SETTINGS,
                since=now.wall,
            )
            self._write([*self._versions, changed])
        return tuple(self._versions)

    async def append(self, rule: Rule) -> None:
        """Write a version down; returns when it is on disk.

        Raises:
            HopError: the disk did not take it.
        """
        try:
            await asyncio.to_thread(self._write, [*self._versions, rule])
        except OSError as error:
            raise HopError("disk", str(error)) from error

    def _read(self) -> list[Rule]:
        try:
            lines = self._path.read_bytes().splitlines()
        except FileNotFoundError:
            return []
        return [self._rule(line, number) for number, line in enumerate(lines, 1)]

    def _rule(self, line: bytes, number: int) -> Rule:
        where = f"line {number}"
        try:
            rule = Rule(**orjson.loads(line))
            usable = (
                0.0 <= rule.threshold <= 1.0
                and LIMITS.ring_least_m <= rule.radius_m <= LIMITS.ring_most_m
            )
        except (orjson.JSONDecodeError, TypeError) as error:
            raise DataFileError(str(self._path), where, str(error)) from error
        if not usable:
            reason = "threshold or radius out of range"
            raise DataFileError(str(self._path), where, reason)
        return rule

    def _write(self, versions: list[Rule]) -> None:
        beside = self._path.with_suffix(".new")
        with beside.open("wb") as file:
            for rule in versions:
                file.write(orjson.dumps(_fields(rule)) + b"\n")
            file.flush()
            os.fsync(file.fileno())
        beside.replace(self._path)
        self._versions = versions


def _agree(one: Rule, other: Rule) -> bool:
    return (one.threshold, one.radius_m) == (other.threshold, other.radius_m)


def _fields(rule: Rule) -> dict[str, object]:
    fields = asdict(rule)
    return {
        **fields,
        "class_thresholds": dict(rule.class_thresholds),
        "aliases": dict(rule.aliases),
    }
