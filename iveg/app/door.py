"""The door of the server: who may come in, read anew beside the requests."""

from dataclasses import dataclass

from iveg.adapters.identity_provider import IdentityProvider
from iveg.adapters.passwords import Passwords
from iveg.adapters.sessions import FileSessions
from iveg.app.life import Work
from iveg.app.outside import Stores
from iveg.domain.single_sign_on import ClaimReading
from iveg.pipeline.audit import AuditTrail
from iveg.pipeline.ports import Clock
from iveg.settings import Settings
from iveg.web.security.authentication import Authenticator
from iveg.web.security.passkeys import Passkeys
from iveg.web.security.people import People
from iveg.web.security.programs import Programs
from iveg.web.security.single_sign_on import SingleSignOn
from iveg.web.security.tablets import Pins


@dataclass(frozen=True, slots=True)
class Door:
    """People with accounts, their passkeys and PINs, and programs."""

    people: People
    passkeys: Passkeys
    programs: Programs
    pins: Pins

    def comfort(self) -> dict[str, Work]:
        """What reads them anew, by name."""
        return {
            "accounts": self.people.run,
            "passkeys": self.passkeys.run,
            "api-tokens": self.programs.run,
        }

    def ways_in(
        self,
        settings: Settings,
        sign_in_token: str,
        sessions: FileSessions,
        trail: AuditTrail,
        provider: IdentityProvider | None,
        clock: Clock,
    ) -> tuple[Authenticator, SingleSignOn | None]:
        """What lets them in, and the identity provider beside it.

        Args:
            settings: An operator's choices.
            sign_in_token: Of the link; empty: there is none.
            sessions: Where sessions outlive a restart.
            trail: Told of every sign-in.
            provider: Vouches for people; None: nobody does.
            clock: Read at each question.
        """
        authenticator = Authenticator(
            sign_in_token=sign_in_token,
            api_token=settings.api_token,
            clock=clock,
            store=sessions,
            link_name=settings.sign_in_name,
            trail=trail,
            people=self.people,
            programs=self.programs,
            passkeys=self.passkeys,
            proven_within_s=settings.release_proof_minutes * 60.0,
        )
        if provider is None:
            return authenticator, None
        reading = ClaimReading(
            settings.sso_role_claim, settings.sso_name_claim, settings.sso_role_map
        )
        lasts_s = settings.sso_hours * 3600.0
        return authenticator, SingleSignOn(
            provider, reading, self.people, authenticator, clock, trail, lasts_s
        )

    def close(self) -> None:
        """End their threads."""
        self.people.close()
        self.passkeys.close()
        self.programs.close()


def open_door(stores: Stores, clock: Clock) -> Door:
    """The door with its stores."""
    people = People(stores.accounts, Passwords(), clock)
    return Door(
        people,
        Passkeys(stores.passkeys, clock),
        Programs(stores.api_tokens, clock),
        Pins(people, clock),
    )
