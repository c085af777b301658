import math
from typing import Any

import numpy as np
import orjson
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from iveg.lab.embedded.orion_numbers import print_value

FLOATS = st.floats(-1e15, 1e15, allow_nan=False)
NUMBERS = FLOATS | st.integers(-(2**53), 2**53)
TEXTS = st.text(alphabet='a1.0e,]}-+ \\"<é', max_size=12)
SINGLES = st.floats(0, 30, width=32)
TIES = st.builds(
    lambda whole, power: whole / 2**power, st.integers(), st.integers(9, 30)
)
"""Most end in a five at the tenth decimal, and nothing after it."""
NEARLY_TIES = st.builds(
    lambda whole, ulps: math.nextafter((whole + 0.5) / 1e9, ulps),
    st.integers(-(10**13), 10**13),
    st.sampled_from([-math.inf, math.inf]),
)
ANY = (
    st.floats(allow_nan=False, allow_infinity=False)
    | st.integers(-(2**63), 2**64 - 1)
    | st.sampled_from([1e19, 1e20, -1e300, 9.2e18, 9.1e18, 5e-324, -0.0, 1e-9, 4.9e-10])
)
LONG: dict[str, Any] = {"min_size": 14, "max_size": 40}
VALUES: st.SearchStrategy[Any] = st.recursive(
    st.none() | st.booleans() | NUMBERS | TEXTS | st.lists(SINGLES | TIES, **LONG),
    lambda inner: (
        st.lists(inner, max_size=6) | st.dictionaries(TEXTS, inner, max_size=4)
    ),
    max_leaves=20,
)


def one_by_one(value: Any) -> Any:
    """The rule as it was first written down, a call for each number."""
    if isinstance(value, float):
        if abs(value) >= 9.2e18:
            return float(f"{value:.17g}".rstrip("0"))
        rounded = round(value, 9)
        return int(rounded) if rounded.is_integer() else rounded
    if isinstance(value, int) and not isinstance(value, bool):
        return one_by_one(float(value)) if abs(value) > 2**53 else value
    if isinstance(value, dict):
        return {key: one_by_one(part) for key, part in value.items()}
    return [one_by_one(part) for part in value] if isinstance(value, list) else value


@given(VALUES)
def test_text_is_what_rounding_every_number_gives(value: Any) -> None:
    assert print_value(value) == orjson.dumps(one_by_one(value))


@given(st.lists(SINGLES | st.none() | st.integers(0, 30), max_size=40))
def test_a_scan_is_printed_as_its_numbers(ranges: list[float | None]) -> None:
    assert print_value(ranges) == orjson.dumps(one_by_one(ranges))


@given(st.lists(TIES | NEARLY_TIES | FLOATS, **LONG))
@example([0.0] * 15 + [-4.9999999999999996e-10])
def test_a_half_at_the_tenth_decimal_is_rounded_as_alone(numbers: list[float]) -> None:
    assert print_value(numbers) == orjson.dumps(one_by_one(numbers))


@given(st.lists(ANY | SINGLES | st.none() | st.booleans() | TEXTS, **LONG))
def test_one_odd_value_in_a_list_spoils_no_other(values: list[Any]) -> None:
    assert print_value(values) == orjson.dumps(one_by_one(values))
    assert print_value({"k": values}) == orjson.dumps(one_by_one({"k": values}))


@pytest.mark.parametrize("spread", [1e-10, 1e-6, 1.0, 12.0, 1e3, 1e6, 1e9, 1e14])
def test_twenty_thousand_numbers_of_any_size_are_rounded_as_alone(
    spread: float,
) -> None:
    draw = np.random.default_rng(7)
    plain = draw.uniform(-spread, spread, 10_000).tolist()
    singles = [float(np.float32(one)) for one in plain]
    assert print_value(plain) == orjson.dumps(one_by_one(plain))
    assert print_value(singles) == orjson.dumps(one_by_one(singles))


@pytest.mark.parametrize(
    ("number", "printed"),
    [
        (1e20, b"100.0"),
        (1e300, b"1000.0000000000001"),
        (12345678901234567, b"12345678901234568"),
        (-0.0, b"0"),
        (1e-12, b"0"),
        (math.pi, b"3.141592654"),
    ],
)
def test_numbers_come_out_as_orion_prints_them(number: float, printed: bytes) -> None:
    assert print_value(number) == printed
    assert print_value([number] * 40) == b"[" + b",".join([printed] * 40) + b"]"
