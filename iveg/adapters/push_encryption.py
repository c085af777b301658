"""Encryption and signing of messages to browsers (RFC 8291, 8188 and 8292, VAPID).

``pywebpush`` does the same and brings requests, aiohttp and four more; this is what is
left of it over ``cryptography``.
"""

import os
from base64 import urlsafe_b64decode, urlsafe_b64encode
from typing import Final
from urllib.parse import urlsplit

import orjson
from cryptography.hazmat.primitives import hashes
from cryptography.hazmat.primitives.asymmetric import ec, utils
from cryptography.hazmat.primitives.ciphers.aead import AESGCM
from cryptography.hazmat.primitives.kdf.hkdf import HKDF
from cryptography.hazmat.primitives.serialization import Encoding, PublicFormat

from iveg.domain.contacts import Push

_CURVE: Final = ec.SECP256R1()


_RECORD_BYTES = 4096


_TOKEN_LIVES_S = 3600


def new_key() -> str:
    """A private key for this server, base64url."""
    private = ec.generate_private_key(_CURVE).private_numbers().private_value
    return encode(private.to_bytes(32, "big"))


def public_key(key: str) -> str:
    """The key as browsers expect it (``applicationServerKey``)."""
    return encode(_point(_private(key)))


def is_public_key(p256dh: str) -> bool:
    """Whether a browser's key is one that can be encrypted for."""
    try:
        ec.EllipticCurvePublicKey.from_encoded_point(_CURVE, decode(p256dh))
    except ValueError:
        return False
    return True


def encrypted(
    content: bytes,
    p256dh: bytes,
    auth: bytes,
    salt: bytes | None = None,
    private: ec.EllipticCurvePrivateKey | None = None,
) -> bytes:
    """One record of ``aes128gcm`` for one browser (RFC 8291 and RFC 8188).

    Args:
        content: At most some 3,900 bytes.
        p256dh: The browser's public key, 65 bytes.
        auth: The browser's secret, 16 bytes.
        salt: 16 bytes, used once; None makes them.
        private: The sender's key for this message; None makes one.

    Raises:
        ValueError: a key that is none.
    """
    salt = salt or os.urandom(16)
    private = private or ec.generate_private_key(_CURVE)
    theirs = ec.EllipticCurvePublicKey.from_encoded_point(_CURVE, p256dh)
    own = _point(private)
    shared = private.exchange(ec.ECDH(), theirs)
    secret = _derived(shared, auth, b"WebPush: info\0" + p256dh + own, 32)
    key = _derived(secret, salt, b"Content-Encoding: aes128gcm\0", 16)
    nonce = _derived(secret, salt, b"Content-Encoding: nonce\0", 12)
    head = salt + _RECORD_BYTES.to_bytes(4, "big") + bytes([len(own)]) + own
    # 2 marks the last record.
    return head + AESGCM(key).encrypt(nonce, content + b"\x02", None)


def signed(endpoint: str, push: Push, wall: float) -> str:
    """The header by which a push service knows this server (RFC 8292)."""
    parts = urlsplit(endpoint)
    claims: dict[str, str | int] = {
        "aud": f"{parts.scheme}://{parts.netloc}",
        "exp": int(wall) + _TOKEN_LIVES_S,
    }
    # Optional (RFC 8292, 2.1); a service that wants one says so in its answer.
    if push.contact:
        claims["sub"] = f"mailto:{push.contact}"
    head = encode(orjson.dumps({"typ": "JWT", "alg": "ES256"}))
    text = f"{head}.{encode(orjson.dumps(claims))}"
    made = _private(push.key).sign(text.encode(), ec.ECDSA(hashes.SHA256()))
    r, s = utils.decode_dss_signature(made)
    signature = encode(r.to_bytes(32, "big") + s.to_bytes(32, "big"))
    return f"vapid t={text}.{signature}, k={public_key(push.key)}"


def encode(raw: bytes) -> str:
    """As base64url without padding."""
    return urlsafe_b64encode(raw).rstrip(b"=").decode("ascii")


def decode(text: str) -> bytes:
    """From base64url, with or without padding. Raises ValueError."""
    return urlsafe_b64decode(text.rstrip("=") + "=" * (-len(text.rstrip("=")) % 4))


def _private(key: str) -> ec.EllipticCurvePrivateKey:
    return ec.derive_private_key(int.from_bytes(decode(key), "big"), _CURVE)


def _point(private: ec.EllipticCurvePrivateKey) -> bytes:
    return private.public_key().public_bytes(
        Encoding.X962, PublicFormat.UncompressedPoint
    )


def _derived(secret: bytes, salt: bytes, info: bytes, length: int) -> bytes:
    return HKDF(hashes.SHA256(), length, salt, info).derive(secret)
