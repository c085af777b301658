"""Numbers as Orion prints them: at most nine decimals, and wrong from 9.2e18 on.

A LiDAR scan is 720 numbers of eleven decimals or more, thirty times a second and robot.
So long lists of numbers are rounded as arrays, where only those whose tenth decimal is
too close to a half for a double are handled one by one.  All else is.
"""

import numpy as np
import orjson
from numpy.typing import NDArray

Floats = NDArray[np.float64]

_HUGE = 9.2e18
_PLAIN = 1e15
"""From 1e16 on orjson prints an exponent, which Orion does not."""
_MANY = 16
"""Least length at which an array is faster than single numbers."""
_SCALE = 1e9
_DOUBT = 2.0**-51
"""Share of a product that bounds its own rounding (2⁻⁵³) with room to spare."""
_NUMERIC = {float, int, type(None)}


def print_value(value: object) -> bytes:
    """JSON text that Orion would print for a value."""
    return orjson.dumps(_as_double(value))


def _print_array(values: list[object]) -> bytes:
    """Print a long list of numbers and nulls; empty for all other lists."""
    if len(values) < _MANY or not _NUMERIC.issuperset(map(type, values)):
        return b""
    given = np.array(values, dtype=np.float64)
    if np.fmax.reduce(np.abs(given)) >= _PLAIN:
        return b""
    rounded = _nine_decimals(given)
    text = orjson.dumps(rounded, option=orjson.OPT_SERIALIZE_NUMPY)
    # A search of the text for whole numbers takes longer.
    return _without_point(text) if (np.rint(rounded) == rounded).any() else text


def _nine_decimals(given: Floats) -> Floats:
    """Round to the nearest nine decimals, as exactly as Python's ``round``.

    The quotient of two whole numbers below 2⁵³ is the double nearest to the decimal,
    so only the choice of the whole number can go wrong: where the product lies within
    its own error of a half, and everywhere once that error is as large.
    """
    product = given * _SCALE
    whole = np.rint(product)
    doubt = np.abs(product - whole) + np.abs(product) * _DOUBT >= 0.5
    rounded: Floats = whole / _SCALE
    for index in doubt.nonzero()[0]:
        rounded[index] = round(float(given[index]), 9)
    # Adding zero turns a negative zero into a positive one.
    return rounded + 0.0


def _without_point(text: bytes) -> bytes:
    """Print whole numbers without ``.0``, which only ends numbers in such a text."""
    return text.replace(b".0,", b",").replace(b".0]", b"]").removesuffix(b".0")


def _as_double(value: object) -> object:
    if isinstance(value, float):
        return _number(value)
    if isinstance(value, int) and not isinstance(value, bool):
        return _number(float(value)) if abs(value) > 2**53 else value
    if isinstance(value, dict):
        return {key: _as_double(part) for key, part in value.items()}
    if isinstance(value, list):
        if printed := _print_array(value):
            return orjson.Fragment(printed)
        return [_as_double(part) for part in value]
    return value


def _number(value: float) -> float | int:
    """A double as printed by Orion's ``double2string``.

    From 9.2e18 on it uses an exponent and then strips trailing zeros, also of the
    exponent: 1e20 becomes 1e+2.  Clients can be tested against that here.
    """
    if abs(value) >= _HUGE:
        return float(f"{value:.17g}".rstrip("0"))
    rounded = round(value, 9)
    return int(rounded) if rounded.is_integer() else rounded
