"""Versions of the rule, in a small file of JSON lines that is replaced as a whole.

The settings make the first version.  A person's change outlives a restart, until the
settings themselves change: then these are newer, and a version of their own.  A version
in which looks did not add up yet stays as it was, and the next one has them.  A file
with a line that cannot be read is put aside, and the strictest rule of what is left of
it is in force until a person makes another.
"""

import asyncio
import logging
from collections.abc import Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from iveg.adapters.files import Form, put_aside, read_lines, write_lines
from iveg.domain.comparison import Comparison
from iveg.domain.detection_rule import (
    ALIASES,
    FORESIGHT_LEAST_S,
    FORESIGHT_MOST_S,
    RECOVERED,
    UPGRADED,
    Class,
    DetectionRule,
    strictest,
)
from iveg.domain.errors import HopError
from iveg.domain.limits import LIMITS
from iveg.domain.observations import Instant
from iveg.domain.stamps import format_stamp

_log = logging.getLogger(__name__)
FORM = Form("rules")
_SETTINGS = "settings"
_FIRST = DetectionRule()
_Share = Annotated[float, Field(ge=0.0, le=1.0, allow_inf_nan=False)]


class FileRules:
    """The rule's versions in one file; implements ``pipeline.ports.RuleStore``."""

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
        versions = _with_looks(versions, now.wall)
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
                damage = damage or f"line {number}: {_first(error)}"
        return rules, damage

    def _write(self, versions: list[DetectionRule]) -> None:
        write_lines(self._path, FORM, map(rule_fields, versions))
        self._versions = versions


def _with_settings(
    versions: list[DetectionRule], settings: DetectionRule, wall: float
) -> list[DetectionRule]:
    """The versions, and one more where the settings are others than last time."""
    last = versions[-1]
    earlier = [
        (rule.threshold, rule.radius_m) for rule in versions if rule.author == _SETTINGS
    ]
    if earlier[-1:] == [(settings.threshold, settings.radius_m)]:
        return versions
    changed = replace(
        last,
        threshold=settings.threshold,
        radius_m=settings.radius_m,
        version=last.version + 1,
        comparison=None,
        author=_SETTINGS,
        since=wall,
    )
    return [*versions, changed]


def _with_looks(versions: list[DetectionRule], wall: float) -> list[DetectionRule]:
    """The versions, and one more where looks did not add up in the last."""
    last = versions[-1]
    if last.possible_people:
        return versions
    changed = replace(
        last,
        possible_people=True,
        version=last.version + 1,
        comparison=None,
        # What was recovered stays to be checked.
        author=RECOVERED if last.author == RECOVERED else UPGRADED,
        since=wall,
    )
    return [*versions, changed]


class StoredRule(BaseModel):
    """One line of the file; a key that is missing has the rule's default."""

    model_config = ConfigDict(strict=True, extra="forbid")

    id: str = _FIRST.id
    version: int = Field(1, ge=1)
    threshold: _Share = LIMITS.detection_threshold
    class_thresholds: dict[Class, _Share] = Field(default_factory=dict)
    radius_m: float = Field(
        LIMITS.ring_default_m, ge=LIMITS.ring_least_m, le=LIMITS.ring_most_m
    )
    aliases: dict[str, Class] = Field(default_factory=lambda: dict(ALIASES))
    possible_people: bool = False
    foresight: bool = True
    foresight_s: float = Field(
        FORESIGHT_MOST_S, ge=FORESIGHT_LEAST_S, le=FORESIGHT_MOST_S
    )
    comparison: Comparison | None = None
    author: str = _SETTINGS
    since: float | None = None

    def rule(self) -> DetectionRule:
        """The version of this line."""
        return DetectionRule(**dict(self))


def _first(error: ValidationError) -> str:
    """The first complaint, in a few words."""
    complaint = error.errors(include_url=False)[0]
    place = ".".join(str(part) for part in complaint["loc"])
    return f"{place}: {complaint['msg']}" if place else complaint["msg"]


def rule_fields(rule: DetectionRule) -> dict[str, object]:
    """The line of a version."""
    fields = asdict(rule)
    return {
        **fields,
        "class_thresholds": dict(rule.class_thresholds),
        "aliases": dict(rule.aliases),
    }
