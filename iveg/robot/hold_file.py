"""The robot's hold set on disk, written atomically.

The file is written under another name, flushed and renamed, so a loss of power leaves
the old set or the new one.  An unreadable file is not treated as an empty set.
"""

from pathlib import Path

import orjson
from pydantic import TypeAdapter, ValidationError

from iveg.adapters.files import write_bytes
from iveg.domain.errors import UnreadableError
from iveg.domain.observations import Hold
from iveg.ngsi.codec import load_json
from iveg.ngsi.payloads import HoldValue
from iveg.robot.holds import HoldSet

_HOLDS = TypeAdapter(list[HoldValue])
_NAMES = TypeAdapter(list[str])


def read_holds(file: Path) -> HoldSet | None:
    """The stored set; an empty one before the first start; None when unreadable."""
    try:
        stored = load_json(file.read_bytes())
        holds = _HOLDS.validate_python(stored["holds"])
        released = _NAMES.validate_python(stored["released"])
        # Files of older versions lack the key.
        joined = _NAMES.validate_python(stored.get("joined", []))
    except FileNotFoundError:
        return HoldSet()
    except (OSError, UnreadableError, ValidationError, KeyError, TypeError):
        return None
    return HoldSet(
        tuple(Hold(hold.id, hold.source, hold.ack) for hold in holds),
        tuple(released),
        tuple(joined),
    )


def write_holds(file: Path, holds: HoldSet) -> None:
    """Store the set; on return it survives a loss of power.

    Raises:
        OSError: the disk refused; the file is as it was.
    """
    file.parent.mkdir(parents=True, exist_ok=True)
    write_bytes(file, orjson.dumps(holds))
