"""The identity provider that the settings name."""

from iveg.adapters import clock
from iveg.adapters.extras import require_extra
from iveg.adapters.identity_provider import Client, IdentityProvider, Keyrock
from iveg.settings import Settings


def open_provider(settings: Settings) -> IdentityProvider | None:
    """The identity provider that the settings name; None: none.

    Raises:
        MissingExtraError: its library is not installed.
    """
    if not settings.sso_issuer:
        return None
    client = Client(
        settings.sso_issuer,
        settings.sso_client_id,
        settings.sso_client_secret,
        settings.sso_scopes,
    )
    if settings.sso_provider == "keyrock":
        return Keyrock(client)
    require_extra("sso", "IVEG_SSO_ISSUER")
    # Only here: without the extra the module cannot be imported.
    from iveg.adapters.oidc import OpenIdProvider

    return OpenIdProvider(client, clock.now)
