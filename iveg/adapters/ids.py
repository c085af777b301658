"""New ids: ULIDs (github.com/ulid/spec), made at each look and each judgement."""

import os
from base64 import b32encode

from iveg.adapters import clock

_PADDED, _LEFT_OUT = 20, 6
"""Bytes that are whole groups of base 32, and leading digits that are always zero."""
_CROCKFORD = bytes.maketrans(
    b"ABCDEFGHIJKLMNOPQRSTUVWXYZ234567", b"0123456789ABCDEFGHJKMNPQRSTVWXYZ"
)


def new_id() -> str:
    """A ULID: 48 bits of milliseconds, then 80 random bits; never reused.

    Ids of one millisecond are in no order.
    """
    milliseconds = int(clock.wall() * 1000).to_bytes(_PADDED - 10, "big")
    digits = b32encode(milliseconds + os.urandom(10))[_LEFT_OUT:]
    return digits.translate(_CROCKFORD).decode()
