from typing import Any

import orjson
import pytest
from hypothesis import given
from hypothesis import strategies as st

from iveg.lab.embedded.errors import FiwareError
from iveg.lab.embedded.orion_text import (
    check_name,
    holds_forbidden,
    looks_clean,
)

NUMBERS = st.floats(-1e15, 1e15, allow_nan=False) | st.integers(-(2**53), 2**53)
TEXTS = st.text(alphabet='a1.0e,]}-+ \\"<é', max_size=12)
VALUES: st.SearchStrategy[Any] = st.recursive(
    st.none() | st.booleans() | NUMBERS | TEXTS,
    lambda inner: (
        st.lists(inner, max_size=6) | st.dictionaries(TEXTS, inner, max_size=4)
    ),
    max_leaves=20,
)


@given(VALUES)
def test_what_looks_clean_holds_nothing_forbidden(value: Any) -> None:
    assert not (looks_clean(orjson.dumps(value)) and holds_forbidden(value))


@pytest.mark.parametrize("character", list("<>\"'=;()"))
def test_each_forbidden_character_is_found_in_values_and_not_in_keys(
    character: str,
) -> None:
    value = {"k": [f"a{character}"]}
    assert holds_forbidden(value)
    assert not looks_clean(orjson.dumps(value))
    assert not holds_forbidden({f"k{character}": 1})


def test_an_escaped_forbidden_character_does_not_look_clean() -> None:
    assert not looks_clean(b'{"a": "\\u003cb"}')


@pytest.mark.parametrize("name", ["", "x" * 257, "a b", "a<", "a/b", "a#b", "a?b"])
def test_a_bad_name_is_refused(name: str) -> None:
    with pytest.raises(FiwareError):
        check_name(name, "entity id")
