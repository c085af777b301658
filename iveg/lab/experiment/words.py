"""Words of the report: English as it is written here, Spanish from a catalogue.

The key of a sentence is its English text with ``#`` for each number, so that one key
serves every value.  Numbers keep their order in both languages.
"""

import json
import re
from collections.abc import Callable
from functools import cache
from importlib.resources import files
from typing import Final, Literal

Language = Literal["en", "es"]
Say = Callable[[str], str]
NUMBER: Final = re.compile(r"(?<![\w.-])\d+(?:,\d{3})*(?:\.\d+)?(?!\.?\w)")
"""A number of its own; no part of a name or version."""
_SIGNS: Final = str.maketrans(".,", ",.")


@cache
def catalogue() -> dict[str, str]:
    """The Spanish of each English sentence."""
    file = files("iveg.lab.experiment") / "report_es.json"
    words: dict[str, str] = json.loads(file.read_text(encoding="utf-8"))
    return words


def english(text: str) -> str:
    """The text itself."""
    return text


def spanish(text: str) -> str:
    """The text in Spanish, its numbers with a comma; a name stays as it is.

    What has no entry as a whole is a list, of which each part may have one.
    """
    numbers = iter(NUMBER.findall(text))
    key, words = NUMBER.sub("#", text), catalogue()
    parts = [words.get(part, part) for part in key.split(", ")]
    said = words.get(key) or ", ".join(parts)
    return re.sub("#", lambda _: next(numbers).translate(_SIGNS), said)


SAY: Final[dict[Language, Say]] = {"en": english, "es": spanish}
