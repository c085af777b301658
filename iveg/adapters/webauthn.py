"""The two ceremonies of WebAuthn; the only importer of the library of that name.

It belongs to ``iveg[passkeys]`` and takes long to import, so each function imports it
itself, in the thread that calls it.  Algorithms and checks are the library's.
"""

import json
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, Final

from iveg.adapters.extras import has_extra, require_extra
from iveg.domain.accounts import Account
from iveg.domain.passkeys import CHALLENGE_S, Passkey

Credential = dict[str, Any]
"""What a browser answers (``PublicKeyCredential.toJSON()``), not yet looked at."""
_TIMEOUT_MS: Final = int(CHALLENGE_S * 1000)
_NAME: Final = "iVeg"


class PasskeyRefusedError(Exception):
    """An answer that proves nothing, whatever is wrong with it."""


@dataclass(frozen=True, slots=True)
class Site:
    """Where passkeys are made for.

    Attributes:
        origin: As browsers say it, such as ``https://iveg.example``.
        rp_id: Its host name.
    """

    origin: str
    rp_id: str


@dataclass(frozen=True, slots=True)
class Asking:
    """What a browser is asked to answer: the challenge, and the options around it."""

    challenge: bytes
    options: dict[str, object]


def require_passkeys() -> None:
    """Raises MissingExtraError: ``iveg[passkeys]`` is not installed."""
    require_extra("passkeys", "a passkey")


def has_passkeys() -> bool:
    """Whether ``iveg[passkeys]`` is installed."""
    return has_extra("passkeys")


def ask_to_register(site: Site, account: Account, known: Iterable[Passkey]) -> Asking:
    """Begin a new passkey that its device can find without a name."""
    import webauthn
    from webauthn.helpers import structs

    made = webauthn.generate_registration_options(
        rp_id=site.rp_id,
        rp_name=_NAME,
        user_id=account.account_id.encode(),
        user_name=account.name,
        timeout=_TIMEOUT_MS,
        authenticator_selection=structs.AuthenticatorSelectionCriteria(
            resident_key=structs.ResidentKeyRequirement.REQUIRED,
            user_verification=structs.UserVerificationRequirement.REQUIRED,
        ),
        exclude_credentials=_described(known),
    )
    return Asking(made.challenge, json.loads(webauthn.options_to_json(made)))


def ask_to_prove(site: Site, known: Iterable[Passkey] = ()) -> Asking:
    """Ask for one of these passkeys; of none: for any that the device knows."""
    import webauthn
    from webauthn.helpers import structs

    made = webauthn.generate_authentication_options(
        rp_id=site.rp_id,
        timeout=_TIMEOUT_MS,
        allow_credentials=_described(known),
        user_verification=structs.UserVerificationRequirement.REQUIRED,
    )
    return Asking(made.challenge, json.loads(webauthn.options_to_json(made)))


def challenge_in(credential: Credential) -> bytes:
    """The challenge that an answer says it answers. Raises PasskeyRefusedError."""
    try:
        from webauthn import base64url_to_bytes
        from webauthn.helpers import parse_client_data_json

        client_data = base64url_to_bytes(credential["response"]["clientDataJSON"])
        challenge: bytes = parse_client_data_json(client_data).challenge
    except Exception as error:
        raise PasskeyRefusedError from error
    return challenge


def register(
    site: Site, account: Account, name: str, credential: Credential, now: float
) -> Passkey:
    """The passkey that an answer brings.

    Args:
        site: Where it is made for.
        account: Whose it is.
        name: What they call it.
        credential: The answer; its challenge was looked at.
        now: This moment (Unix s).

    Raises:
        PasskeyRefusedError: it is none.
    """
    try:
        import webauthn

        made = webauthn.verify_registration_response(
            credential=credential,
            expected_challenge=challenge_in(credential),
            expected_rp_id=site.rp_id,
            expected_origin=site.origin,
            require_user_verification=True,
        )
    # What strangers send makes the parsers of CBOR and COSE raise anything.
    except Exception as error:
        raise PasskeyRefusedError from error
    return Passkey(
        credential_id=webauthn.helpers.bytes_to_base64url(made.credential_id),
        account_id=account.account_id,
        name=name,
        rp_id=site.rp_id,
        public_key=webauthn.helpers.bytes_to_base64url(made.credential_public_key),
        sign_count=made.sign_count,
        made_at=now,
    )


def prove(site: Site, passkey: Passkey, credential: Credential) -> int:
    """The count of uses that an answer by this passkey tells.

    Raises:
        PasskeyRefusedError: wrong signature, place or count, nobody verified.
    """
    try:
        import webauthn

        proven = webauthn.verify_authentication_response(
            credential=credential,
            expected_challenge=challenge_in(credential),
            expected_rp_id=passkey.rp_id,
            expected_origin=site.origin,
            credential_public_key=webauthn.base64url_to_bytes(passkey.public_key),
            credential_current_sign_count=passkey.sign_count,
            require_user_verification=True,
        )
        handle = credential["response"].get("userHandle")
        if (
            handle
            and webauthn.base64url_to_bytes(handle).decode() != passkey.account_id
        ):
            raise PasskeyRefusedError
    except Exception as error:
        raise PasskeyRefusedError from error
    count: int = proven.new_sign_count
    return count


def _described(known: Iterable[Passkey]) -> list[object]:
    from webauthn import base64url_to_bytes
    from webauthn.helpers.structs import PublicKeyCredentialDescriptor

    return [
        PublicKeyCredentialDescriptor(id=base64url_to_bytes(one.credential_id))
        for one in known
    ]
