"""The rule's versions, in a small file of JSON lines.

The settings make the first version.  A person's change outlives a restart.  When the
settings themselves change, they make a newer version.  A file with an unreadable line
is put aside.  Then the strictest rule of the readable lines is in force until a person
makes another.
"""

import asyncio
import logging
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from iveg.adapters.files import (
    Form,
    disk_errors,
    put_aside,
    read_lines,
    write_lines,
)
from iveg.domain.comparison import Comparison
from iveg.domain.detection_rule import (
    ALIASES,
    DetectionRule,
    strictest,
)
from iveg.domain.observations import Instant
from iveg.domain.parameters import PARAMETERS, Class, by_names
from iveg.domain.stamps import format_stamp
from iveg.models.base import with_fields
from iveg.models.rule import parameter_fields
from iveg.ngsi.codec.fields import first_complaint

_log = logging.getLogger(__name__)
FORM = Form("rules")
_SETTINGS = "settings"
_FIRST = DetectionRule()


class FileRules:
    """The versions of the rule in one file."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._versions: list[DetectionRule] = []

    def load(self, settings: DetectionRule, now: Instant) -> Sequence[DetectionRule]:
        """All versions, oldest first; the last is in force.

        Args:
            settings: The rule of the settings.
            now: Time from which changed settings count.

        Raises:
            DataFileError: the file is something else, or of a newer iVeg.
        """
        read, damage = self._read()
        versions = _with_settings(read or [settings], settings, now.wall)
        if damage:
            self._recover([*versions, strictest(versions, now.wall)], damage, now)
        elif len(versions) > max(1, len(read)):
            self._write(versions)
        else:
            self._versions = versions
        return tuple(self._versions)

    def _recover(
        self, versions: list[DetectionRule], damage: str, now: Instant
    ) -> None:
        """Put the file aside and begin another with these versions."""
        # In force even where the disk refuses the new file.
        self._versions = versions
        stamp = format_stamp(now.wall).replace(":", "")
        if put_aside(self._path, damage, f"damaged-{stamp}"):
            try:
                self._write(versions)
            except OSError as error:
                _log.error("%s could not be written: %s", self._path, error)

    async def append(self, rule: DetectionRule) -> None:
        """Write a version; returns when it is on disk.

        Raises:
            HopError: the disk did not take it.
        """
        with disk_errors():
            await asyncio.to_thread(self._write, [*self._versions, rule])

    def _read(self) -> tuple[list[DetectionRule], str]:
        """Readable versions, and the first unreadable line with its reason."""
        rules, damage = [], ""
        for number, line in read_lines(self._path, FORM):
            try:
                rules.append(StoredRule.model_validate_json(line).rule())
            except ValidationError as error:
                damage = damage or f"line {number}: {first_complaint(error)}"
        return rules, damage

    def _write(self, versions: list[DetectionRule]) -> None:
        write_lines(self._path, FORM, map(rule_fields, versions))
        self._versions = versions


def _with_settings(
    versions: list[DetectionRule], settings: DetectionRule, wall: float
) -> list[DetectionRule]:
    """The versions, and one more where a setting has changed since the last start.

    That version changes those settings alone; people's other choices stay.
    """
    last, before = versions[-1], _as_set(versions)
    now = {row.name: getattr(settings, row.name) for row in PARAMETERS}
    new = {name: value for name, value in now.items() if before.get(name) != value}
    if replace(last, **new) == last:
        return versions
    # No trial led to this version.
    new |= {"comparison": None, "author": _SETTINGS, "since": wall}
    return [*versions, replace(last, version=last.version + 1, **new)]


def _as_set(versions: list[DetectionRule]) -> dict[str, Any]:
    """Parameters of the settings: each from its last change by the settings."""
    values = dict[str, Any]()
    for before, rule in zip([None, *versions], versions, strict=False):
        if rule.author != _SETTINGS:
            continue
        for row in PARAMETERS:
            value = getattr(rule, row.name)
            is_new = before is None or getattr(before, row.name) != value
            if is_new or row.name not in values:
                values[row.name] = value
    return values


class _StoredRule(BaseModel):
    """One line of the file; a key that is missing has the rule's default."""

    model_config = ConfigDict(strict=True, extra="forbid")

    id: str = _FIRST.id
    version: int = Field(1, ge=1)
    aliases: dict[str, Class] = Field(default_factory=lambda: dict(ALIASES))
    possible_people: bool = True
    comparison: Comparison | None = None
    author: str = _SETTINGS
    since: float | None = None

    def rule(self) -> DetectionRule:
        """The version of this line."""
        stored = dict(self)
        values: dict[str, Any] = {
            row.name: row.read(stored, row.default, row.name) for row in PARAMETERS
        }
        values |= {name: stored[name] for name in _StoredRule.model_fields}
        # Looks always add up now, also for a version stored when they did not.
        values["possible_people"] = True
        return DetectionRule(**values)


StoredRule = with_fields(parameter_fields(lambda row: row.name, "default"))(_StoredRule)


def rule_fields(rule: DetectionRule) -> dict[str, object]:
    """The line of a version."""
    fields = {name: getattr(rule, name) for name in _StoredRule.model_fields}
    return {**by_names(rule), **fields, "aliases": dict(rule.aliases)}
