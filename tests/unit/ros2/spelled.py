"""CDR payloads spelled out by hand, a word for each primitive.

Words are hexadecimal, lowest byte first; ``'text'`` is a text with its zero, ``--`` a
byte of padding, ``36*…`` a word so many times.  Counted from 0, a word of n bytes must
begin at a multiple of n: where it would not, the padding stands that CDR asks for.
"""

import re
from collections.abc import Sequence
from typing import Literal

_WORD = re.compile(r"(?:(\d+)\*)?(?:'([^']*)'|(--)|([0-9a-f]+))")

ZERO = "0000000000000000"
ONE = "000000000000f03f"
TWO = "0000000000000040"
HALF = "000000000000e03f"
STAMP = "07000000 05000000"
"""7 s and 5 ns."""
MAP = "04000000 'map'"
"""With the stamp before it 16 bytes."""
POSE = f"{ONE} {TWO} {ZERO} {ZERO} {ZERO} {ZERO} {ONE}"
"""At (1, 2, 0), not turned."""


def payload(words: str | Sequence[str], order: Literal["<", ">"]) -> bytes:
    """The bytes with their encapsulation, in one byte order."""
    text = words if isinstance(words, str) else " ".join(words)
    out = bytes((0, 1 if order == "<" else 0, 0, 0))
    for times, said, gap, digits in _WORD.findall(text):
        one = _bytes(said, gap, digits, order)
        out += one * int(times or 1)
    return out


def _bytes(said: str, gap: str, digits: str, order: str) -> bytes:
    if gap:
        return b"\x00"
    if not digits:
        return said.encode() + b"\x00"
    raw = bytes.fromhex(digits)
    return raw if order == "<" else raw[::-1]
