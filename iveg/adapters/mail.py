"""Messages as mail: one connection a message, a letter each, always encrypted."""

import asyncio
import ssl
from collections.abc import Callable, Sequence
from datetime import UTC, datetime
from email.message import EmailMessage
from email.utils import format_datetime, make_msgid

import aiosmtplib

from iveg.adapters.outbound import OutboundHttp
from iveg.domain.contacts import Contacts, Email, MailRecipient
from iveg.domain.errors import OutboundError
from iveg.domain.messages import Language, MessageDelivery, MessageText, OutboundMessage
from iveg.domain.observations import Instant

Write = Callable[[OutboundMessage, Language], MessageText]


class MailSender:
    """Sends by the server of the settings.

    Args:
        outside: The way there.
        write: The message in words.
    """

    def __init__(self, outside: OutboundHttp, write: Write) -> None:
        self._outbound = outside
        self._write = write

    async def send(
        self, contacts: Contacts, message: OutboundMessage, now: Instant
    ) -> Sequence[MessageDelivery]:
        """A letter to each recipient, where a server is known."""
        email = contacts.email
        if not email.server or not email.recipients:
            return []
        text = self._write(message, email.language)
        try:
            async with asyncio.timeout(self._outbound.timeout_s):
                return await self._send(email, text, now)
        except TimeoutError:
            why = "no_answer"
        except (OutboundError, aiosmtplib.SMTPException, OSError) as error:
            why = _why(error)
        return [MessageDelivery("email", one.who, now, why) for one in email.recipients]

    async def _send(
        self, email: Email, text: MessageText, now: Instant
    ) -> list[MessageDelivery]:
        connection = await self._outbound.connect(email.server, email.port)
        own = connection.getsockname()[0]
        client = aiosmtplib.SMTP(
            hostname=email.server,
            sock=connection,
            # Its own question for this machine's name would wait for a name server.
            local_hostname=f"[IPv6:{own}]" if ":" in own else f"[{own}]",
            use_tls=email.security == "tls",
            start_tls=email.security == "starttls",
            tls_context=await self._outbound.tls(),
            username=email.user or None,
            password=email.password or None,
            timeout=self._outbound.timeout_s,
        )
        async with client:
            return [
                await _letter(client, email, one, text, now) for one in email.recipients
            ]


async def _letter(
    client: aiosmtplib.SMTP,
    email: Email,
    to: MailRecipient,
    text: MessageText,
    now: Instant,
) -> MessageDelivery:
    letter = EmailMessage()
    letter["From"], letter["To"] = email.sender, to.address
    letter["Subject"] = text.title
    letter["Date"] = format_datetime(datetime.fromtimestamp(now.wall, UTC))
    letter["Message-ID"] = make_msgid(domain=email.sender.rpartition("@")[2])
    # Absent people's machines are not to answer it (RFC 3834).
    letter["Auto-Submitted"] = "auto-generated"
    letter.set_content(text.body)
    try:
        await client.send_message(letter)
    except aiosmtplib.SMTPResponseException as error:
        return MessageDelivery("email", to.who, now, _why(error))
    except aiosmtplib.SMTPRecipientsRefused:
        return MessageDelivery("email", to.who, now, "refused")
    return MessageDelivery("email", to.who, now)


def _why(error: Exception) -> str:
    match error:
        case OutboundError():
            return error.why
        case aiosmtplib.SMTPAuthenticationError():
            return "sign_in"
        case ssl.SSLCertVerificationError():
            return "certificate"
        case aiosmtplib.SMTPResponseException() | aiosmtplib.SMTPRecipientsRefused():
            return "refused"
    return "certificate" if "certificate" in str(error).lower() else "no_answer"
