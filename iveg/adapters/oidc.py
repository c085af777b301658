"""OpenID Connect by Authlib: the code flow with PKCE, and ID tokens that are verified.

The only importer of authlib, joserfc and httpx2 (extra ``sso``).  Authlib gets checked
addresses from a provider's description, never the description.  Authlib would take its
members as settings of the client, such as PKCE and proxy, accept each algorithm in it,
and keep a withdrawn key until a restart.
Sources: OpenID Connect Core 1.0, 3.1; Discovery 1.0; RFC 7636.
"""

from typing import Any, Final

import httpx2
from authlib.integrations.starlette_client import OAuth, OAuthError
from authlib.oidc.discovery import get_well_known_url
from joserfc.errors import JoseError

from iveg.adapters.bounded_json import BoundedJson
from iveg.adapters.identity_provider import HOP, Attempt, Client
from iveg.domain.errors import HopError, SignOnError
from iveg.domain.records import Json
from iveg.domain.wire import clean_text
from iveg.setting_types import is_safe_address

ALGORITHMS: Final = tuple(
    f"{kind}{bits}" for kind in ("RS", "PS", "ES") for bits in (256, 384, 512)
)
"""Accepted signatures: asymmetric alone, so neither ``none`` nor ``HS256``."""
LEEWAY_S: Final = 30
"""Greatest error of the provider's clock (s)."""
_ENDPOINTS: Final = ("authorization_endpoint", "token_endpoint", "jwks_uri")
_CARRIED: Final = ("Authorization", "Content-Type")
"""Headers of Authlib that are sent; ``BoundedJson`` sets all others."""


class OpenIdProvider:
    """Provider that vouches for people; without an answer methods raise HopError.

    Its addresses come from OpenID Connect Discovery.
    """

    def __init__(self, client: Client) -> None:
        self._client = client
        self._http = BoundedJson(HOP)

    async def address(self, attempt: Attempt) -> str:
        """Address at which a browser signs in, with the password each time.

        Tablets are shared: after a sign-out of iVeg the next person must not come in by
        a session that the provider still has in this browser.
        """
        app = self._app(await self._discover())
        authorization = await app.create_authorization_url(
            attempt.back,
            state=attempt.state,
            nonce=attempt.nonce,
            code_verifier=attempt.verifier,
            prompt="login",
        )
        return str(authorization["url"])

    async def vouch(self, attempt: Attempt, code: str) -> Json:
        """Exchange a code for claims about a person, with ``iss`` and ``sub``.

        Raises:
            SignOnError: the code or the ID token proves nothing.
        """
        about = await self._discover()
        app = self._app(about)
        required = {
            "iss": {"essential": True, "value": self._client.issuer},
            "aud": {"essential": True, "value": self._client.client_id},
            "sub": {"essential": True},
        }
        try:
            token = await app.fetch_access_token(
                attempt.back, code=code, code_verifier=attempt.verifier
            )
            claims = await app.parse_id_token(
                token, attempt.nonce, required, leeway=LEEWAY_S
            )
        except OAuthError as error:
            reason = clean_text(str(error.error)[:40])
            raise SignOnError("untrusted", f"the code was refused: {reason}") from error
        except httpx2.HTTPStatusError as error:
            status = error.response.status_code
            raise SignOnError("untrusted", f"no ID token, but {status}") from error
        except (
            JoseError,
            httpx2.InvalidURL,
            LookupError,
            TypeError,
            ValueError,
        ) as error:
            reason = type(error).__name__
            raise SignOnError("untrusted", f"ID token: {reason}") from error
        if claims is None:
            raise SignOnError("untrusted", "no ID token in the answer")
        if "userinfo_endpoint" in about and "access_token" in token:
            bearer = {"Authorization": f"Bearer {token['access_token']}"}
            url = about["userinfo_endpoint"]
            info = await self._http.ask("GET", url, headers=bearer)
            # Core, 5.3.2: user info without the same `sub` must not be used.
            if info.is_success and info.body.get("sub") == claims["sub"]:
                # The signed claims come last, and win.
                return {**info.body, **claims}
        return dict(claims)

    async def close(self) -> None:
        """Close connections."""
        await self._http.close()

    async def _discover(self) -> Json:
        """The provider's description, with checked addresses.  Raises HopError."""
        url = get_well_known_url(self._client.issuer, external=True)
        answer = await self._http.ask("GET", url)
        about = answer.body
        if not answer.is_success:
            raise HopError(HOP, f"{answer.status} to its own description")
        if about.get("issuer") != self._client.issuer:
            raise HopError(HOP, "says that it is another issuer")
        for name in {*_ENDPOINTS, *about.keys() & {"userinfo_endpoint"}}:
            address = about.get(name)
            if not isinstance(address, str) or not is_safe_address(address):
                raise HopError(HOP, f"its {name} cannot be used")
        return about

    def _app(self, about: Json) -> Any:
        """Authlib's client for one step; a longer life would keep withdrawn keys."""
        return OAuth().register(
            HOP,
            client_id=self._client.client_id,
            client_secret=self._client.secret,
            authorize_url=about["authorization_endpoint"],
            access_token_url=about["token_endpoint"],
            jwks_uri=about["jwks_uri"],
            id_token_signing_alg_values_supported=ALGORITHMS,
            client_kwargs={
                "scope": self._client.scopes,
                "code_challenge_method": "S256",
                "transport": _BoundedTransport(self._http),
            },
        )


class _BoundedTransport(httpx2.AsyncBaseTransport):
    """Authlib's requests over ``BoundedJson``: bounded in time and size."""

    def __init__(self, http: BoundedJson) -> None:
        self._http = http

    async def handle_async_request(self, request: httpx2.Request) -> httpx2.Response:
        sent = request.headers
        answer = await self._http.ask(
            request.method,
            str(request.url),
            content=await request.aread(),
            headers={name: sent[name] for name in _CARRIED if name in sent},
        )
        return httpx2.Response(answer.status, json=answer.body)
