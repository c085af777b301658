"""The way in for another device."""

from pydantic import Field

from iveg.models.base import Model


class SignInCode(Model):
    """The sign-in link, and its QR code as a data address of an image."""

    link: str
    image: str
    local: bool = Field(
        description="The address works on the server's own computer alone."
    )
