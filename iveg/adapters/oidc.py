"""OpenID Connect: discovery, the code flow with PKCE, and ID tokens that are verified.

The only importer of authlib and of joserfc, which comes with it (extra ``sso``).
Sources: OpenID Connect Core 1.0, 3.1; Discovery 1.0; RP-Initiated Logout 1.0; RFC 7636.
"""

import asyncio
from collections.abc import Callable, Mapping
from typing import Any, Final
from urllib.parse import urlencode, urlsplit

from authlib.oauth2.rfc7636 import create_s256_code_challenge
from authlib.oidc.core import CodeIDToken
from authlib.oidc.discovery import get_well_known_url
from joserfc import jwt
from joserfc.errors import JoseError
from joserfc.jwk import ECKey, RSAKey
from joserfc.jws import extract_compact

from iveg.adapters.bounded_json import BoundedJson
from iveg.adapters.identity_provider import (
    HOP,
    Attempt,
    Client,
    Vouched,
    code_query,
    redeem,
    text_of,
)
from iveg.domain.errors import HopError, SignOnError
from iveg.domain.observations import Instant
from iveg.domain.records import Json
from iveg.setting_types import is_safe_address

ALGORITHMS: Final = tuple(
    f"{kind}{bits}" for kind in ("RS", "PS", "ES") for bits in (256, 384, 512)
)
"""Signatures that count: of nobody else's making, so neither ``none`` nor ``HS256``."""
LEEWAY_S: Final = 30
"""How far the provider's clock may be off (s)."""
_KNOWN_S, _KEYS_AGAIN_S = 3600.0, 30.0
_MOST_KEYS: Final = 100
_RSA_CHARACTERS: Final = range(342, 1367)
"""Of a modulus of 2048 to 8192 bits; a longer one takes a processor too long."""

_Key = dict[str, Any]


class OpenIdProvider:
    """A provider that says by discovery where everything is.

    Args:
        client: iVeg, as the provider knows it.
        clock: Read at each question.
    """

    def __init__(self, client: Client, clock: Callable[[], Instant]) -> None:
        self.client = client
        self._clock = clock
        self._http = BoundedJson(HOP)
        self._about: Json = {}
        self._keys: list[_Key] = []
        self._known_at = self._keys_at = -_KNOWN_S
        self._asking = asyncio.Lock()

    async def address(self, attempt: Attempt) -> str:
        """Where a browser goes to sign in."""
        about = await self._discover()
        query = {
            **code_query(self.client, attempt),
            "scope": self.client.scopes,
            "nonce": attempt.nonce,
            "code_challenge": create_s256_code_challenge(attempt.verifier),
            "code_challenge_method": "S256",
        }
        return _with_query(about["authorization_endpoint"], query)

    async def vouch(self, attempt: Attempt, code: str) -> Vouched:
        """Exchange the code, and verify what comes for it."""
        about = await self._discover()
        url = about["token_endpoint"]
        answer = await redeem(self._http, self.client, url, attempt, code)
        token = text_of(answer, "id_token")
        claims = await self._verified(token, attempt.nonce, answer.get("access_token"))
        user = await self._user_info(about, answer, claims)
        # What is signed comes last, and wins.
        return Vouched(text_of(claims, "sub"), {**user, **claims}, token)

    async def sign_out_address(self, back: str, id_token: str) -> str | None:
        """Where a browser goes to sign out there, too; None: not offered."""
        url = (await self._discover()).get("end_session_endpoint")
        if url is None:
            return None
        query = {"client_id": self.client.client_id, "post_logout_redirect_uri": back}
        return _with_query(
            url, query | ({"id_token_hint": id_token} if id_token else {})
        )

    async def close(self) -> None:
        """Close connections."""
        await self._http.close()

    async def _discover(self) -> Json:
        """Where everything is; asked for once an hour, by one at a time."""
        async with self._asking:
            now = self._clock().mono
            if not self._about or now - self._known_at >= _KNOWN_S:
                url = get_well_known_url(self.client.issuer, external=True)
                answer = await self._http.get(url)
                if not answer.is_success:
                    raise HopError(HOP, f"{answer.status} to its own description")
                self._about = _checked(answer.body, self.client.issuer)
                self._known_at = now
            return self._about

    async def _user_info(self, about: Json, token: Json, claims: Json) -> Json:
        """What the provider tells beside the ID token; nothing of somebody else."""
        url, access = about.get("userinfo_endpoint"), token.get("access_token")
        if url is None or not isinstance(access, str):
            return {}
        bearer = {"Authorization": f"Bearer {access}"}
        answer = await self._http.get(url, headers=bearer)
        # Core, 5.3.2: without the same `sub` it must not be used.
        is_theirs = answer.is_success and answer.body.get("sub") == claims["sub"]
        return answer.body if is_theirs else {}

    async def _verified(self, token: str, nonce: str, access_token: object) -> Json:
        """The claims of an ID token.

        Raises:
            SignOnError: it proves nothing.
        """
        try:
            header = extract_compact(token.encode()).headers()
        except (JoseError, ValueError) as error:
            raise SignOnError("untrusted", "the ID token is none") from error
        key = await self._key(header)
        expected = {
            "nonce": nonce,
            "client_id": self.client.client_id,
            "access_token": access_token,
        }
        try:
            read = jwt.decode(token, key, algorithms=ALGORITHMS)
            options = {
                "iss": {"essential": True, "value": self.client.issuer},
                "aud": {"essential": True, "value": self.client.client_id},
            }
            claims = CodeIDToken(read.claims, read.header, options, expected)
            claims.validate(int(self._clock().wall), LEEWAY_S)
        except (JoseError, ValueError, TypeError) as error:
            why = type(error).__name__
            raise SignOnError("untrusted", f"ID token: {why}") from error
        return dict(claims)

    async def _key(self, header: Json) -> RSAKey | ECKey:
        """The key that must have signed; keys are read anew where it is unknown."""
        if header.get("alg") not in ALGORITHMS:
            raise SignOnError(
                "untrusted", "an ID token of a signature that proves nothing"
            )
        about = await self._discover()
        async with self._asking:
            found = _find(self._keys, header)
            now = self._clock().mono
            if found is None and now - self._keys_at >= _KEYS_AGAIN_S:
                answer = await self._http.get(about["jwks_uri"])
                self._keys, self._keys_at = _keys_of(answer.body), now
                found = _find(self._keys, header)
        if found is None:
            raise SignOnError("untrusted", "an ID token of an unknown key")
        try:
            return (RSAKey if found["kty"] == "RSA" else ECKey).import_key(found)
        except (JoseError, ValueError, TypeError) as error:
            raise SignOnError("untrusted", "a key that is none") from error


def _checked(about: Json, issuer: str) -> Json:
    """A description whose addresses may be used. Raises HopError."""
    if about.get("issuer") != issuer:
        raise HopError(HOP, "says that it is another issuer")
    needed = ("authorization_endpoint", "token_endpoint", "jwks_uri")
    for name in (*needed, "userinfo_endpoint", "end_session_endpoint"):
        address = about.get(name)
        if address is None and name not in needed:
            continue
        if not isinstance(address, str) or not is_safe_address(address):
            raise HopError(HOP, f"its {name} cannot be used")
    return about


def _keys_of(key_set: Json) -> list[_Key]:
    keys = key_set.get("keys")
    if not isinstance(keys, list) or len(keys) > _MOST_KEYS:
        raise HopError(HOP, "its keys cannot be used")
    return [one for one in keys if isinstance(one, dict) and _is_usable(one)]


def _is_usable(key: Json) -> bool:
    if key.get("use", "sig") != "sig" or not isinstance(key.get("kid", ""), str):
        return False
    if key.get("kty") == "EC":
        return True
    n, e = key.get("n"), key.get("e")
    return (
        key.get("kty") == "RSA"
        and isinstance(n, str)
        and isinstance(e, str)
        and len(n) in _RSA_CHARACTERS
        and len(e) <= 8
    )


def _find(keys: list[_Key], header: Json) -> _Key | None:
    """The one key that a header means; without ``kid`` only where there is one."""
    kind = "EC" if header["alg"].startswith("ES") else "RSA"
    fitting = [one for one in keys if one["kty"] == kind]
    if "kid" in header:
        fitting = [one for one in fitting if one.get("kid") == header["kid"]]
    return fitting[0] if len(fitting) == 1 else None


def _with_query(url: str, query: Mapping[str, str]) -> str:
    return f"{url}{'&' if urlsplit(url).query else '?'}{urlencode(query)}"
