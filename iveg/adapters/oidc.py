"""OpenID Connect: discovery, the code flow with PKCE, and ID tokens that are verified.

The only importer of authlib and of joserfc, which comes with it (extra ``sso``).
Authlib's Starlette client is not used: it wants httpx2 and sessions in signed cookies.
Sources: OpenID Connect Core 1.0, 3.1; Discovery 1.0; RFC 7636.
"""

from typing import Any, Final
from urllib.parse import urlencode, urlsplit

from authlib.oauth2.rfc7636 import create_s256_code_challenge
from authlib.oidc.core import CodeIDToken
from authlib.oidc.discovery import get_well_known_url
from joserfc import jwt
from joserfc.errors import JoseError
from joserfc.jwk import KeySet

from iveg.adapters.identity_provider import (
    HOP,
    Attempt,
    IdentityProvider,
    Vouched,
    text_of,
)
from iveg.domain.errors import HopError, SignOnError
from iveg.domain.records import Json
from iveg.setting_types import is_safe_address

ALGORITHMS: Final = tuple(
    f"{kind}{bits}" for kind in ("RS", "PS", "ES") for bits in (256, 384, 512)
)
"""Signatures that count: of nobody else's making, so neither ``none`` nor ``HS256``."""
LEEWAY_S: Final = 30
"""Greatest error of the provider's clock (s)."""
_ENDPOINTS: Final = ("authorization_endpoint", "token_endpoint", "jwks_uri")


class OpenIdProvider(IdentityProvider):
    """A provider that says by discovery where everything is."""

    async def address(self, attempt: Attempt) -> str:
        """Where a browser goes to sign in, anew each time.

        Tablets are shared: after a sign-out of iVeg nobody comes in by a session that
        the provider still has in this browser.
        """
        url: str = (await self._discover())["authorization_endpoint"]
        query = {
            "response_type": "code",
            "client_id": self.client.client_id,
            "redirect_uri": attempt.back,
            "state": attempt.state,
            "scope": self.client.scopes,
            "prompt": "login",
            "nonce": attempt.nonce,
            "code_challenge": create_s256_code_challenge(attempt.verifier),
            "code_challenge_method": "S256",
        }
        return f"{url}{'&' if urlsplit(url).query else '?'}{urlencode(query)}"

    async def vouch(self, attempt: Attempt, code: str) -> Vouched:
        """Exchange the code of an attempt, and verify what comes for it."""
        about = await self._discover()
        answer = await self._redeem(about["token_endpoint"], attempt, code)
        token, access = text_of(answer, "id_token"), answer.get("access_token")
        keys = await self._http.get(about["jwks_uri"])
        claims = self._verified(token, attempt.nonce, access, keys.body)
        user: Json = {}
        if "userinfo_endpoint" in about and isinstance(access, str):
            bearer = {"Authorization": f"Bearer {access}"}
            info = await self._http.get(about["userinfo_endpoint"], headers=bearer)
            # Core, 5.3.2: without the same `sub` it must not be used.
            if info.is_success and info.body.get("sub") == claims["sub"]:
                user = info.body
        # What is signed comes last, and wins.
        return Vouched(text_of(claims, "sub"), {**user, **claims})

    async def _redeem(self, url: str, attempt: Attempt, code: str) -> Json:
        """Exchange a code at the token endpoint (RFC 6749, 4.1.3; RFC 7636, 4.5)."""
        form = {
            "grant_type": "authorization_code",
            "code": code,
            "redirect_uri": attempt.back,
            "code_verifier": attempt.verifier,
        }
        login = None
        if self.client.secret:
            login = self.client.client_id, self.client.secret
        else:
            form["client_id"] = self.client.client_id
        answer = await self._http.post(url, form, login)
        if not answer.is_success:
            raise SignOnError("untrusted", f"the code was refused: {answer.refusal}")
        return answer.body

    async def _discover(self) -> Json:
        """The provider's description, whose addresses may be used. Raises HopError."""
        answer = await self._http.get(
            get_well_known_url(self.client.issuer, external=True)
        )
        about = answer.body
        if not answer.is_success:
            raise HopError(HOP, f"{answer.status} to its own description")
        if about.get("issuer") != self.client.issuer:
            raise HopError(HOP, "says that it is another issuer")
        for name in {*_ENDPOINTS, *about.keys() & {"userinfo_endpoint"}}:
            address = about.get(name)
            if not isinstance(address, str) or not is_safe_address(address):
                raise HopError(HOP, f"its {name} cannot be used")
        return about

    def _verified(self, token: str, nonce: str, access: object, keys: Json) -> Json:
        """The claims of an ID token. Raises SignOnError: it proves nothing."""
        client_id = self.client.client_id
        expected = {"nonce": nonce, "client_id": client_id, "access_token": access}
        required: dict[str, Any] = {
            "iss": {"essential": True, "value": self.client.issuer},
            "aud": {"essential": True, "value": client_id},
        }
        try:
            known = KeySet.import_key_set(keys)  # type: ignore[arg-type]
            read = jwt.decode(token, known, algorithms=ALGORITHMS)
            claims = CodeIDToken(read.claims, read.header, required, expected)
            claims.validate(leeway=LEEWAY_S)
        except (JoseError, ValueError, TypeError, KeyError) as error:
            why = type(error).__name__
            raise SignOnError("untrusted", f"ID token: {why}") from error
        return dict(claims)
