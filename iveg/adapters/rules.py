"""The rule's versions, in a small file of JSON lines.

The settings make the first version.  A person's change outlives a restart, until the
settings themselves change: then these are newer, and a version of their own.  A file
with a line that cannot be read is put aside, and the strictest rule of what is left of
it is in force until a person makes another.
"""

import asyncio
import logging
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pydantic import BaseModel, ConfigDict, Field, ValidationError, create_model

from iveg.adapters.files import (
    Form,
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
from iveg.domain.errors import HopError
from iveg.domain.observations import Instant
from iveg.domain.parameters import PARAMETERS, Class, by_names
from iveg.domain.stamps import format_stamp
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
        """All versions, oldest first; the last is to be in force.

        Args:
            settings: The rule as the settings have it.
            now: When settings that differ from those of last time began to count.

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
        self._versions = versions
        stamp = format_stamp(now.wall).replace(":", "")
        if put_aside(self._path, damage, f"damaged-{stamp}"):
            try:
                self._write(versions)
            except OSError as error:
                _log.error("%s could not be written: %s", self._path, error)

    async def append(self, rule: DetectionRule) -> None:
        """Write a version down; returns when it is on disk.

        Raises:
            HopError: the disk did not take it.
        """
        try:
            await asyncio.to_thread(self._write, [*self._versions, rule])
        except OSError as error:
            raise HopError("disk", str(error)) from error

    def _read(self) -> tuple[list[DetectionRule], str]:
        """The versions that can be read, and where and why one of them cannot."""
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
    """The versions, and one more where a setting is another than last time.

    Of that one only what the settings changed is new: the rest is as people left it.
    """
    last, before = versions[-1], _as_set(versions)
    now = {row.name: getattr(settings, row.name) for row in PARAMETERS}
    new = {name: value for name, value in now.items() if before.get(name) != value}
    if replace(last, **new) == last:
        return versions
    return [*versions, _next(last, _SETTINGS, wall, **new)]


def _next(
    last: DetectionRule, author: str, wall: float, **changes: Any
) -> DetectionRule:
    """The version after another; it came of no trial."""
    changes |= {"comparison": None, "author": author, "since": wall}
    return replace(last, version=last.version + 1, **changes)


def _as_set(versions: list[DetectionRule]) -> dict[str, Any]:
    """The parameters as the settings had them last: each where they changed it last."""
    found = dict[str, Any]()
    for before, rule in zip([None, *versions], versions, strict=False):
        if rule.author != _SETTINGS:
            continue
        for row in PARAMETERS:
            value = getattr(rule, row.name)
            is_new = before is None or getattr(before, row.name) != value
            if is_new or row.name not in found:
                found[row.name] = value
    return found


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
        # Looks always add up, also in versions of before that was so.
        values["possible_people"] = True
        return DetectionRule(**values)


if TYPE_CHECKING:
    StoredRule = _StoredRule
else:
    StoredRule = create_model(
        "StoredRule",
        __base__=_StoredRule,
        **parameter_fields(lambda row: row.name, "default"),
    )


def rule_fields(rule: DetectionRule) -> dict[str, object]:
    """The line of a version."""
    own = {name: getattr(rule, name) for name in _StoredRule.model_fields}
    return {**by_names(rule), **own, "aliases": dict(rule.aliases)}
