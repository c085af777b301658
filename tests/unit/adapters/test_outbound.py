"""Issue 13.23: messages leave for public https addresses alone, by every channel."""

import asyncio
import threading
from base64 import urlsafe_b64decode
from ipaddress import ip_address

import orjson
import pytest
from cryptography.hazmat.primitives import hashes
from cryptography.hazmat.primitives.asymmetric import ec, utils

from iveg.adapters import push_encryption
from iveg.adapters.mail import MailSender
from iveg.adapters.outbound import OutboundHttp
from iveg.adapters.public_addresses import is_public, is_public_target
from iveg.adapters.push_encryption import decode, encode, encrypted, new_key
from iveg.adapters.web_push import PushSender
from iveg.adapters.webhook import WebhookSender
from iveg.domain.contacts import (
    Contacts,
    Email,
    MailRecipient,
    Push,
    SubscribedBrowser,
    Webhook,
)
from iveg.domain.errors import OutboundError
from iveg.domain.messages import AlertItem, Language, MessageText, OutboundMessage
from tests.builders import START
from tests.fakes.outbound import HttpsStand, MailStand, loopback, standing

ALERT = OutboundMessage([AlertItem("01J", "P1", "stop_unconfirmed", START)])


def write(message: OutboundMessage, language: Language) -> MessageText:
    return MessageText(f"iVeg: {message.priority}", f"({language})")


def hooked(url: str) -> Contacts:
    return Contacts(webhook=Webhook(True, "Guardia", url))


def mailed(stand: MailStand, *people: str, wrong: str = "") -> Contacts:
    recipients = tuple(MailRecipient(who, f"{who}@coop.es") for who in people)
    return Contacts(
        email=Email(
            on=True,
            server="localhost",
            port=stand.port,
            user="iveg",
            password=wrong or stand.password,
            sender="iveg@coop.es",
            recipients=recipients,
        )
    )


@pytest.mark.parametrize(
    "address",
    [
        "127.0.0.1",
        "10.0.0.7",
        "172.16.3.4",
        "192.168.1.20",
        "169.254.169.254",
        "100.100.100.200",
        "0.0.0.0",  # noqa: S104 - nobody listens there
        "224.0.0.1",
        "255.255.255.255",
        "::1",
        "::",
        "fe80::1",
        "fd00:ec2::254",
        "ff02::1",
        "::ffff:169.254.169.254",
        "64:ff9b::a9fe:a9fe",
        "2002:a9fe:a9fe::1",
        "fec0::1",
        "feff:ffff::1",
        "::ffff:10.0.0.1",
        "64:ff9b::10.0.0.1",
        "64:ff9b::127.0.0.1",
        "64:ff9b:1::10.0.0.1",
        "::ffff:0:10.0.0.1",
        "::127.0.0.1",
    ],
)
def test_no_address_of_a_greenhouse_or_a_cloud_is_public(address: str) -> None:
    assert not is_public(ip_address(address))


@pytest.mark.parametrize(
    "address",
    [
        "93.184.215.14",
        "2606:2800:21f:cb07::1",
        "::ffff:93.184.215.14",
        "64:ff9b::93.184.215.14",
    ],
)
def test_an_address_of_the_internet_is_public(address: str) -> None:
    assert is_public(ip_address(address))


@pytest.mark.parametrize(
    "url",
    [
        "http://coop.es/hook",
        "https://user:secret@coop.es/hook",
        "https://localhost/hook",
        "https://metadata.google.internal/hook",
        "https://169.254.169.254/latest",
        "https://[::1]/hook",
        "https://coop.es:99999/hook",
        "https:///hook",
        "ftp://coop.es",
        "",
    ],
)
def test_an_address_that_looks_wrong_is_refused_before_it_is_kept(url: str) -> None:
    assert not is_public_target(url)


def test_an_address_of_the_internet_is_kept() -> None:
    assert is_public_target("https://hooks.coop.es:8443/a?b=c")


async def test_a_name_that_leads_home_is_refused_before_anything_is_sent() -> None:
    stand = HttpsStand()
    async with standing(stand):
        sender = WebhookSender(OutboundHttp())
        told = await sender.send(hooked(stand.url()), ALERT, START)

    assert [one.failed for one in told] == ["not_public"]
    assert stand.asked == []


async def test_a_webhook_is_told_how_grave_and_when_and_nothing_of_where() -> None:
    stand = HttpsStand()
    async with standing(stand):
        sender = WebhookSender(loopback())
        told = await sender.send(hooked(stand.url()), ALERT, START)

    (headers, content) = stand.asked[0]
    assert headers["host"] == f"localhost:{stand.port}"
    assert orjson.loads(content) == {
        "iveg": "alert",
        "sent_at": "2023-11-14T22:13:20.000Z",
        "priority": "P1",
        "alerts": [
            {
                "alert_id": "01J",
                "priority": "P1",
                "key": "stop_unconfirmed",
                "raised_at": "2023-11-14T22:13:20.000Z",
            }
        ],
    }
    assert [(one.to, one.failed) for one in told] == [("Guardia", None)]


@pytest.mark.parametrize("status", [302, 404, 500])
async def test_what_is_not_taken_is_refused_and_no_redirect_is_followed(
    status: int,
) -> None:
    stand = HttpsStand(status)
    async with standing(stand):
        sender = WebhookSender(loopback())
        told = await sender.send(hooked(stand.url()), ALERT, START)

    assert [one.failed for one in told] == ["refused"]
    assert len(stand.asked) == 1


async def test_a_server_that_hangs_is_given_up() -> None:
    stand = HttpsStand(hangs=True)
    async with standing(stand):
        sender = WebhookSender(loopback(timeout_s=0.2))
        told = await sender.send(hooked(stand.url()), ALERT, START)

    assert [one.failed for one in told] == ["no_answer"]


async def test_a_certificate_of_another_name_is_not_believed() -> None:
    stand = HttpsStand()
    async with standing(stand):
        with pytest.raises(OutboundError, match="certificate"):
            await loopback().post(stand.url(host="127.0.0.1"), b"", {})

    assert stand.asked == []


async def test_each_recipient_gets_a_letter_of_their_own() -> None:
    stand = MailStand()
    async with standing(stand):
        sender = MailSender(loopback(), write)
        told = await sender.send(mailed(stand, "ana", "eva"), ALERT, START)

    assert [to for to, _ in stand.letters] == ["ana@coop.es", "eva@coop.es"]
    assert "eva" not in stand.letters[0][1]
    assert "Subject: iVeg: P1" in stand.letters[0][1]
    assert [(one.to, one.failed) for one in told] == [("ana", None), ("eva", None)]


async def test_one_recipient_that_is_refused_keeps_the_letter_from_nobody() -> None:
    stand = MailStand(refuses=frozenset({"ana@coop.es"}))
    async with standing(stand):
        sender = MailSender(loopback(), write)
        told = await sender.send(mailed(stand, "ana", "eva"), ALERT, START)

    assert [(one.to, one.failed) for one in told] == [("ana", "refused"), ("eva", None)]


async def test_a_wrong_password_is_said_to_be_that() -> None:
    stand = MailStand()
    async with standing(stand):
        sender = MailSender(loopback(), write)
        told = await sender.send(mailed(stand, "ana", wrong="x"), ALERT, START)

    assert [one.failed for one in told] == ["sign_in"]
    assert stand.letters == []


async def test_a_mail_server_at_home_is_refused() -> None:
    stand = MailStand()
    async with standing(stand):
        told = await MailSender(OutboundHttp(), write).send(
            mailed(stand, "ana"), ALERT, START
        )

    assert [one.failed for one in told] == ["not_public"]


def test_a_push_is_encrypted_as_the_example_of_rfc_8291() -> None:
    private = ec.derive_private_key(
        int.from_bytes(decode("yfWPiYE-n46HLnH0KqZOF1fJJU3MYrct3AELtAQ-oRw"), "big"),
        ec.SECP256R1(),
    )

    made = encrypted(
        b"When I grow up, I want to be a watermelon",
        decode(
            "BCVxsr7N_eNgVRqvHtD0zTZsEc6-VV-JvLexhqUzORcxaOzi6-AYWXvTBHm4bjyPjs7Vd8pZGH6S"
            "RpkNtoIAiw4"
        ),
        decode("BTBZMqHH6r4Tts7J_aSIgg"),
        decode("DGv6ra1nlYgDCS1FRnbzlw"),
        private,
    )

    assert encode(made) == (
        "DGv6ra1nlYgDCS1FRnbzlwAAEABBBP4z9KsN6nGRTbVYI_c7VJSPQTBtkgcy27mlmlMoZIIgDll6e3vC"
        "YLocInmYWAmS6TlzAC8wEqKK6PBru3jl7A_yl95bQpu6cVPTpK4Mqgkf1CXztLVBSt2Ks3oZwbuwXPXL"
        "WyouBWLVWGNWQexSgSxsj_Qulcy4a-fN"
    )


def subscribed(stand: HttpsStand) -> Contacts:
    browser = push_encryption.public_key(new_key())
    device = SubscribedBrowser(
        "D1", "ana", stand.url("/push/1"), browser, encode(b"s" * 16), "es", 0.0
    )
    return Contacts(push=Push(True, "ana@coop.es", (device,), new_key()))


async def test_a_push_is_signed_for_the_service_that_carries_it() -> None:
    stand = HttpsStand()
    async with standing(stand):
        contacts = subscribed(stand)
        told = await PushSender(loopback(), write).send(contacts, ALERT, START)

    headers, content = stand.asked[0]
    token, key = headers["authorization"].removeprefix("vapid t=").split(", k=")
    claims = orjson.loads(decode(token.split(".")[1]))
    assert claims["aud"] == f"https://localhost:{stand.port}"
    assert claims["sub"] == "mailto:ana@coop.es"
    assert 0 < claims["exp"] - START.wall <= 24 * 3600
    _verify(token, key)
    assert (headers["content-encoding"], headers["urgency"]) == ("aes128gcm", "high")
    assert b"P1" not in content
    assert [(one.to, one.failed) for one in told] == [("ana", None)]


def test_without_a_contact_a_push_names_none() -> None:
    header = push_encryption.signed(
        "https://push.coop.es/1", Push(True, key=new_key()), 0.0
    )

    claims = orjson.loads(decode(header.removeprefix("vapid t=").split(".")[1]))
    assert claims.keys() == {"aud", "exp"}


async def test_a_browser_that_its_service_forgot_is_gone() -> None:
    stand = HttpsStand(410)
    async with standing(stand):
        contacts = subscribed(stand)
        told = await PushSender(loopback(), write).send(contacts, ALERT, START)

    assert [(one.device_id, one.failed) for one in told] == [("D1", "gone")]


async def test_a_name_server_that_hangs_takes_no_thread_of_others() -> None:
    outside = OutboundHttp()
    await asyncio.gather(
        *(outside.resolve("127.0.0.1", 443) for _ in range(20)), return_exceptions=True
    )

    used = {one.name for one in threading.enumerate()}
    assert len([name for name in used if name.startswith("outside")]) <= 2
    assert not [name for name in used if name.startswith("asyncio")]


def _verify(token: str, key: str) -> None:
    text, _, signature = token.rpartition(".")
    raw = urlsafe_b64decode(signature + "==")
    made = utils.encode_dss_signature(
        int.from_bytes(raw[:32], "big"), int.from_bytes(raw[32:], "big")
    )
    public = ec.EllipticCurvePublicKey.from_encoded_point(ec.SECP256R1(), decode(key))
    public.verify(made, text.encode(), ec.ECDSA(hashes.SHA256()))
