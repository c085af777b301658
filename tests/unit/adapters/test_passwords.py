"""Argon2id off the loop: what fits, what takes as long, and how much waits."""

import time
from collections.abc import Iterator

import pytest

from iveg.adapters.passwords import Passwords


@pytest.fixture
def passwords() -> Iterator[Passwords]:
    passwords = Passwords()
    yield passwords
    passwords.close()


async def test_a_password_fits_its_own_hash_and_nothing_else(
    passwords: Passwords,
) -> None:
    kept, again = await passwords.hashed("acelga-1"), await passwords.hashed("acelga-1")

    assert kept.startswith("$argon2id$v=19$m=19456,t=2,p=1$")
    assert kept != again
    assert await passwords.fits("acelga-1", kept)
    assert not await passwords.fits("Acelga-1", kept)
    for none in ("", "#", "$argon2id$v=19$m=8,t=1,p=1$AAAA$AAAA", "ñ"):
        assert not await passwords.fits("", none)


async def test_a_name_that_is_not_there_takes_as_long_as_a_wrong_password(
    passwords: Passwords,
) -> None:
    kept = await passwords.hashed("acelga-1")
    await passwords.fits("x", "")
    spent = {"": 0.0, kept: 0.0}
    for _ in range(8):
        for one in spent:
            began = time.process_time()
            await passwords.fits("wrong", one)
            spent[one] += time.process_time() - began

    assert 0.5 < spent[""] / spent[kept] < 2.0
