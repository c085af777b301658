"""Names that people may have."""

import pytest

from iveg.domain.accounts import is_name
from iveg.domain.wire import FORBIDDEN


@pytest.mark.parametrize(
    "name", ["Ana", "Ana Núñez", "José-María O’Neill", "安娜", "a" * 64]
)
def test_a_name_of_any_language_is_one(name: str) -> None:
    assert is_name(name)


@pytest.mark.parametrize(
    "name",
    ["", " ", "Ana ", "a" * 65, "A\nna", "A\x00na", "A\u202ena", "N\u0303", "\ud800"],
)
def test_what_cannot_be_shown_or_read_back_is_no_name(name: str) -> None:
    assert not is_name(name)


def test_a_name_holds_nothing_for_which_orion_refuses_a_stop() -> None:
    assert [one for one in FORBIDDEN if is_name(f"A{one}na")] == []
