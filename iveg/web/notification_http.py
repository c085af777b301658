"""HTTP protocol of the server that answers a plain notification at once.

Hundreds of notifications come in a second and none waits for anything, so a task, a
queue and an event for each would cost more than its content.  A request that is not
plain (another route, a wrong secret, a body of unknown length, a request behind one
that is still being answered) is handled as usual by uvicorn.
"""

from uvicorn.protocols.http.httptools_impl import STATUS_LINE, HttpToolsProtocol

from iveg.web.notifications import NotificationEndpoint
from iveg.web.problem import Problem
from iveg.web.security.headers import NOTIFICATIONS_PATH

_URL = NOTIFICATIONS_PATH.encode()


class NotificationHttp(HttpToolsProtocol):
    """One connection of Orion's, or anybody's.

    Attributes:
        endpoint: Of the connection's server; set by a subclass for each.
    """

    endpoint: NotificationEndpoint
    _body: list[bytes] | None = None

    @property
    def is_notification(self) -> bool:
        """Whether a notification with the right secret is on its way."""
        return self._body is not None

    def on_headers_complete(self) -> None:
        """The head is here: whether this is a plain notification is known."""
        if self._is_plain():
            self._body = []
        else:
            super().on_headers_complete()

    def on_body(self, body: bytes) -> None:
        """A part of a body."""
        if self._body is None:
            super().on_body(body)
        else:
            self._body.append(body)

    def on_message_complete(self) -> None:
        """The request is whole."""
        if self._body is None:
            super().on_message_complete()
            return
        body, self._body = b"".join(self._body), None
        self._answer(self.endpoint.receive(body))
        self.on_response_complete()

    def _is_plain(self) -> bool:
        is_free = self.cycle is None or self.cycle.response_complete
        return (
            self.url == _URL
            and is_free
            and not self.pipeline
            and not self.flow.write_paused
            and not self.expect_100_continue
            and self.parser.get_method() == b"POST"
            and self.parser.should_keep_alive()
            and not self.parser.should_upgrade()
            and self.endpoint.fits_at_once(dict(reversed(self.headers)))
        )

    def _answer(self, problem: Problem | None) -> None:
        status, headers, body = 204, self.server_state.default_headers, b""
        if problem is not None:
            response = problem.response()
            status, body = response.status_code, bytes(response.body)
            headers = [*headers, *response.raw_headers]
        parts = [STATUS_LINE[status]]
        for name, value in headers:
            parts += (name, b": ", value, b"\r\n")
        parts += (b"\r\n", body)
        self.transport.write(b"".join(parts))
