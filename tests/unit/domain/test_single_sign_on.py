"""What an identity provider's claims mean: names, roles, ids."""

from contextlib import suppress

import pytest
from hypothesis import given
from hypothesis import strategies as st

from iveg.domain.accounts import (
    ClaimReading,
    another_name,
    is_name,
    name_of,
    person_id,
    values_at,
)
from iveg.domain.errors import SignOnError
from tests.fakes.identity_provider import KEYCLOAK

ROLES = {"growers": "operator", "owners": "admin", "guests": "viewer"}
OBJECTS = {"organizations": [{"name": "coop", "roles": [{"name": "owners"}]}]}


@pytest.mark.parametrize(
    ("claims", "path", "found"),
    [
        (KEYCLOAK, "realm_access.roles", ["offline_access", "growers"]),
        ({"groups": ["0760b6cf", "13e8"]}, "groups", ["0760b6cf", "13e8"]),
        (OBJECTS, "organizations[].name", ["coop"]),
        (OBJECTS, "organizations[].roles[].name", ["owners"]),
        ({"https://iveg.test/roles": "guests"}, "https://iveg.test/roles", ["guests"]),
        ({"roles": "growers"}, "roles.name", []),
        ({"roles": [["growers"], 1, None, {"a": 1}]}, "roles", []),
        ({}, "roles", []),
        ({"roles": {"": "x"}}, "roles", []),
    ],
)
def test_a_path_finds_the_roles_in_each_shape(
    claims: dict[str, object], path: str, found: list[str]
) -> None:
    assert list(values_at(claims, path)) == found


@pytest.mark.parametrize(
    ("told", "role"),
    [
        (["guests", "owners", "growers"], "admin"),
        (["guests"], "viewer"),
        (["Owners", "owners ", "admin"], None),
        ([], None),
    ],
)
def test_the_highest_mapped_role_counts_and_no_other(
    told: list[str], role: str | None
) -> None:
    reading = ClaimReading("roles", "name", ROLES)  # type: ignore[arg-type]

    given: str | None = None
    with suppress(SignOnError):
        given = reading.read("https://a.test", "1", {"roles": told}).role

    assert given == role


def test_a_person_is_issuer_and_subject_and_not_their_name() -> None:
    ids = {
        person_id("https://a.test", "1"),
        person_id("https://a.test/", "1"),
        person_id("https://a.test", "2"),
    }

    assert len(ids) == 3
    assert person_id("https://a.test", "1") in ids


@given(st.text(max_size=300))
def test_whatever_name_is_told_orion_takes_the_one_that_is_made(told: str) -> None:
    person = person_id("https://a.test", told)

    name = name_of(told, person)

    assert is_name(name)
    assert is_name(another_name(name, person))


@pytest.mark.parametrize(
    ("told", "name"),
    [
        ("Ana Núñez", "Ana Núñez"),
        (" Ana <b>\u202e(x);\n", "Ana bx"),
        ("", "sso-0b1d2c3e"),
    ],
)
def test_a_name_stays_as_it_is_but_for_what_orion_refuses(told: str, name: str) -> None:
    assert name_of(told, "sso-0b1d2c3e4f") == name
