"""The robot's hold set on disk, written atomically.

The file is written under another name, flushed and renamed, so a loss of power leaves
the old set or the new one.  An unreadable file is not treated as an empty set.
"""

from pathlib import Path

import orjson
from pydantic import Field, ValidationError

from iveg.adapters.files import write_bytes
from iveg.domain.errors import UnreadableError
from iveg.ngsi.codec import fields, load_json
from iveg.ngsi.payloads import HoldValue, Wire
from iveg.robot.holds import HoldSet


class _StoredHolds(Wire):
    """The file; those of older versions lack ``joined``."""

    holds: list[HoldValue]
    released: list[str]
    joined: list[str] = Field(default_factory=list)


def read_holds(file: Path) -> HoldSet | None:
    """The stored set; an empty one before the first start; None when unreadable."""
    try:
        stored = _StoredHolds.model_validate(load_json(file.read_bytes()))
    except FileNotFoundError:
        return HoldSet()
    except (OSError, UnreadableError, ValidationError):
        return None
    holds = fields.read_holds(stored.holds)
    return HoldSet(holds, tuple(stored.released), tuple(stored.joined))


def write_holds(file: Path, holds: HoldSet) -> None:
    """Store the set; on return it survives a loss of power.

    Raises:
        OSError: the disk refused; the file is as it was.
    """
    file.parent.mkdir(parents=True, exist_ok=True)
    write_bytes(file, orjson.dumps(holds))
