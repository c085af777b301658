"""Answers to programs and the page: models as JSON, written once."""

from starlette.responses import Response

from iveg.models.base import write_json


class Json(Response):
    """A JSON answer that is written once, by orjson."""

    media_type = "application/json"

    def render(self, content: object) -> bytes:
        """The bytes of the answer."""
        return write_json(content)
