"""OpenID Connect: what an answer of the provider proves, and what a bad one costs."""

import time
from collections.abc import AsyncIterator
from urllib.parse import parse_qs, urlsplit

import pytest

from iveg.adapters.fiware_http import TokenGrant
from iveg.adapters.identity_provider import Attempt, Client
from iveg.adapters.oidc import OpenIdProvider
from iveg.domain.errors import HopError, SignOnError
from iveg.domain.records import Json
from tests.fakes.identity_provider import (
    CLIENT,
    KEYCLOAK,
    SECRET,
    FakeIdentityProvider,
    own_url,
    serving,
)

BACK = "http://iveg.test/signin/sso/callback"


@pytest.fixture
async def provider() -> AsyncIterator[FakeIdentityProvider]:
    made = FakeIdentityProvider(own_url(), {"ana-1": dict(KEYCLOAK)})
    async with serving(made):
        yield made


@pytest.fixture
async def openid(provider: FakeIdentityProvider) -> AsyncIterator[OpenIdProvider]:
    client = Client(provider.url, CLIENT, SECRET, "openid profile")
    made = OpenIdProvider(client)
    yield made
    await made.close()


async def vouched(openid: OpenIdProvider, provider: FakeIdentityProvider) -> Json:
    attempt = Attempt(BACK)
    back = provider.approve(await openid.address(attempt), "ana-1")
    return await openid.vouch(attempt, parse_qs(urlsplit(back).query)["code"][0])


@pytest.mark.parametrize("alg", ["RS256", "PS512", "ES256"])
async def test_a_person_is_vouched_for_by_a_signed_token(
    openid: OpenIdProvider, provider: FakeIdentityProvider, alg: str
) -> None:
    provider.alg = alg
    provider.__post_init__()

    proof = await vouched(openid, provider)

    assert proof["sub"] == "ana-1"
    assert proof["realm_access"] == KEYCLOAK["realm_access"]
    # The client's secret is sent by the header that no log of forms keeps.
    assert "client_secret" not in provider.forms[0]


async def test_the_code_is_tied_to_the_browser_by_pkce(
    openid: OpenIdProvider, provider: FakeIdentityProvider
) -> None:
    attempt = Attempt(BACK)
    address = await openid.address(attempt)
    code = parse_qs(urlsplit(provider.approve(address, "ana-1")).query)["code"][0]

    with pytest.raises(SignOnError, match="invalid_grant"):
        await openid.vouch(Attempt(BACK, nonce=attempt.nonce), code)

    assert "code_challenge_method=S256" in address
    assert attempt.verifier not in address


async def test_a_description_says_where_to_ask_and_sets_nothing_of_the_client(
    openid: OpenIdProvider, provider: FakeIdentityProvider
) -> None:
    # Authlib would take all of it as settings.
    provider.also = {
        "code_challenge_method": None,
        "id_token_signing_alg_values_supported": ["HS256"],
        "jwks": {"keys": []},
        "proxy": "http://127.0.0.1:1",
        "token_endpoint_auth_method": "client_secret_post",
    }

    assert "code_challenge_method=S256" in await openid.address(Attempt(BACK))
    assert (await vouched(openid, provider))["sub"] == "ana-1"
    assert "client_secret" not in provider.forms[0]


@pytest.mark.parametrize(
    ("vice", "why"),
    [
        ("none", "UnsupportedAlgorithmError"),
        ("shared_secret", "UnsupportedAlgorithmError"),
        ("public_key_as_secret", "UnsupportedAlgorithmError"),
        ("foreign_key", "BadSignatureError"),
        ("no_token", "DecodeError"),
        ("unsigned", "no ID token"),
    ],
)
async def test_a_token_that_nobody_else_signed_proves_nothing(
    openid: OpenIdProvider, provider: FakeIdentityProvider, vice: str, why: str
) -> None:
    provider.vice = vice

    with pytest.raises(SignOnError, match=why) as refused:
        await vouched(openid, provider)

    assert refused.value.failure == "untrusted"


@pytest.mark.parametrize(
    ("claim", "value"),
    [
        ("iss", "https://somebody-else.test"),
        ("aud", "another-client"),
        ("aud", [CLIENT, "another-client"]),
        ("azp", "another-client"),
        ("aud", None),
        ("exp", 1),
        ("exp", None),
        ("iat", 1e11),
        ("nonce", "of-another-sign-in"),
        ("nonce", None),
        ("sub", None),
        ("at_hash", "b2YgYW5vdGhlciB0b2tlbg"),
    ],
)
async def test_a_token_with_one_wrong_claim_proves_nothing(
    openid: OpenIdProvider, provider: FakeIdentityProvider, claim: str, value: object
) -> None:
    provider.id_token = {claim: value}

    with pytest.raises(SignOnError, match="ID token: ") as refused:
        await vouched(openid, provider)

    assert refused.value.failure == "untrusted"


async def test_clocks_may_differ_by_half_a_minute(
    openid: OpenIdProvider, provider: FakeIdentityProvider
) -> None:
    # Its tokens are good for 300 s.
    provider.wall = lambda: time.time() - 320.0
    await vouched(openid, provider)
    provider.wall = lambda: time.time() - 340.0
    with pytest.raises(SignOnError):
        await vouched(openid, provider)


async def test_a_new_key_counts_at_once_and_one_that_is_gone_no_more(
    openid: OpenIdProvider, provider: FakeIdentityProvider
) -> None:
    provider.rotate()
    again = await vouched(openid, provider)
    provider.published.pop()
    with pytest.raises(SignOnError, match="ID token: "):
        await vouched(openid, provider)

    assert again["sub"] == "ana-1"


async def test_user_info_adds_what_the_token_lacks_and_only_of_the_same_person(
    openid: OpenIdProvider, provider: FakeIdentityProvider
) -> None:
    provider.in_user_info = True
    told = await vouched(openid, provider)
    provider.vice = "other_user_info"
    other = await vouched(openid, provider)

    assert told["name"] == "Ana Núñez"
    assert "name" not in other


@pytest.mark.parametrize(
    "vice",
    [
        "wrong_issuer",
        "plain_http",
        "endless_address",
        "huge /token",
        "away /keys",
        "many_keys",
        "loop /userinfo",
        "away",
        "large_key",
    ],
)
async def test_a_bad_provider_is_refused_in_bounded_time_and_memory(
    openid: OpenIdProvider, provider: FakeIdentityProvider, vice: str
) -> None:
    provider.vice = vice
    begun = time.monotonic()

    # A redirect is not followed: nothing of the user, but the token counts.
    if vice == "loop /userinfo":
        assert (await vouched(openid, provider))["sub"] == "ana-1"
    else:
        with pytest.raises((HopError, SignOnError)):
            await vouched(openid, provider)

    assert len(provider.asked) <= 5
    assert time.monotonic() - begun < 5.0


def test_nothing_that_is_secret_is_shown_by_a_traceback() -> None:
    attempt, client = Attempt(BACK), Client("https://a.test", CLIENT, SECRET, "")
    grant = TokenGrant("http://a/token", CLIENT, SECRET, "ana", "a-password")
    shown = repr((attempt, client, grant))

    secret = (SECRET, attempt.state, attempt.nonce, attempt.verifier, "a-password")
    assert [one for one in secret if one in shown] == []
