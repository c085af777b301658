"""Errors of HTTP's boundary alone.

Under the tree of ``domain/errors``::

    IvegError
    ├── NotSignedInError    401
    ├── ForeignOriginError  403
    ├── PasskeyAddressError 409
    ├── PinRefusedError     403, 429
    ├── ProofNeededError    403
    └── NotJsonError        415
"""

from iveg.domain.errors import IvegError


class NotSignedInError(IvegError):
    """The request is not authenticated."""

    def __init__(self) -> None:
        super().__init__("Sign in with the link that iVeg printed, or send a token.")


class ForeignOriginError(IvegError):
    """A browser sent this from another site, or without iVeg's own header."""

    def __init__(self, missing: str) -> None:
        super().__init__(f"This did not come from iVeg's own page: {missing}.")


class ProofNeededError(IvegError):
    """Somebody is signed in and has to prove anew that it is them."""

    def __init__(self) -> None:
        super().__init__("Prove again who you are: POST /api/v1/account/proof.")


class PinRefusedError(IvegError):
    """A PIN that is wrong, or comes while its person has to wait.

    Attributes:
        wait_s: How long it is refused (s); 0: not at all.
        left: Tries until the next wait; None: it was not looked at.
    """

    def __init__(self, wait_s: float, left: int | None = None) -> None:
        super().__init__("The PIN is refused.")
        self.wait_s, self.left = wait_s, left


class PasskeyAddressError(IvegError):
    """Browsers make no passkeys for an address in numbers."""

    def __init__(self) -> None:
        super().__init__("Passkeys need an address with a name, such as iveg.example.")


class NotJsonError(IvegError):
    """A body that is not declared as JSON."""

    def __init__(self) -> None:
        super().__init__("Send the body as application/json.")
