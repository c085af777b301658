"""The ways in, as the settings say, the identity provider's among them."""

from iveg.adapters import clock
from iveg.adapters.extras import require_extra
from iveg.adapters.identity_provider import Client, IdentityProvider, Keyrock
from iveg.adapters.sessions import FileSessions
from iveg.domain.single_sign_on import ClaimReading
from iveg.pipeline.audit import AuditTrail
from iveg.settings import Settings
from iveg.web.security.authentication import Authenticator
from iveg.web.security.people import People
from iveg.web.security.programs import Programs
from iveg.web.security.single_sign_on import SingleSignOn


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


def ways_in(
    settings: Settings,
    sign_in_token: str,
    known: tuple[People, Programs],
    sessions: FileSessions,
    trail: AuditTrail,
    provider: IdentityProvider | None,
) -> tuple[Authenticator, SingleSignOn | None]:
    """What lets people and programs in, and the identity provider beside it.

    Args:
        settings: An operator's choices.
        sign_in_token: Of the link; empty: there is none.
        known: Those with accounts and tokens of their own.
        sessions: Where sessions outlive a restart.
        trail: Told of every sign-in.
        provider: Vouches for people; None: nobody does.
    """
    people, programs = known
    authenticator = Authenticator(
        sign_in_token=sign_in_token,
        api_token=settings.api_token,
        clock=clock.now,
        store=sessions,
        link_name=settings.sign_in_name,
        trail=trail,
        people=people,
        programs=programs,
    )
    if provider is None:
        return authenticator, None
    reading = ClaimReading(
        settings.sso_role_claim, settings.sso_name_claim, settings.sso_role_map
    )
    lasts_s = settings.sso_hours * 3600.0
    return authenticator, SingleSignOn(
        provider, reading, people, authenticator, clock.now, trail, lasts_s
    )
