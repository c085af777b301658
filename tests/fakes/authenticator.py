"""A security key in software: ES256, discoverable, with a counter (WebAuthn 2)."""

import hashlib
import json
from base64 import urlsafe_b64decode, urlsafe_b64encode
from typing import Any

import cbor2
from cryptography.hazmat.primitives import hashes
from cryptography.hazmat.primitives.asymmetric import ec

PRESENT, VERIFIED, ATTESTED = 0x01, 0x04, 0x40


def b64(data: bytes) -> str:
    return urlsafe_b64encode(data).rstrip(b"=").decode()


def unb64(text: str) -> bytes:
    return urlsafe_b64decode(text + "=" * (-len(text) % 4))


class FakeAuthenticator:
    """Answers options of a server as the browser at ``origin`` would.

    Attributes:
        flags: Whether a person was present and verified.
        count: Uses so far, as it tells them.
    """

    def __init__(self, origin: str, credential_id: bytes = b"c" * 32) -> None:
        self.origin = origin
        self.credential_id = credential_id
        self.flags = PRESENT | VERIFIED
        self.count = 0
        self.rp_id, self.user = "", ""
        self._key = ec.generate_private_key(ec.SECP256R1())

    def register(self, options: dict[str, Any]) -> dict[str, Any]:
        self.rp_id, self.user = options["rp"]["id"], options["user"]["id"]
        named = len(self.credential_id).to_bytes(2) + self.credential_id
        attested = bytes(16) + named + self._cose()
        data = self._data(self.flags | ATTESTED) + attested
        statement = {"fmt": "none", "attStmt": {}, "authData": data}
        return self._answer(
            {
                "clientDataJSON": self._client("webauthn.create", options),
                "attestationObject": b64(cbor2.dumps(statement)),
            }
        )

    def prove(self, options: dict[str, Any]) -> dict[str, Any]:
        self.count += 1
        client = self._client("webauthn.get", options)
        data = self._data(self.flags)
        signed = data + hashlib.sha256(unb64(client)).digest()
        return self._answer(
            {
                "clientDataJSON": client,
                "authenticatorData": b64(data),
                "signature": b64(self._key.sign(signed, ec.ECDSA(hashes.SHA256()))),
                "userHandle": self.user,
            }
        )

    def _answer(self, response: dict[str, str]) -> dict[str, Any]:
        told = b64(self.credential_id)
        return {"id": told, "rawId": told, "type": "public-key", "response": response}

    def _client(self, kind: str, options: dict[str, Any]) -> str:
        told = {"type": kind, "challenge": options["challenge"], "origin": self.origin}
        return b64(json.dumps(told).encode())

    def _data(self, flags: int) -> bytes:
        place = hashlib.sha256(self.rp_id.encode()).digest()
        return place + bytes([flags]) + self.count.to_bytes(4)

    def _cose(self) -> bytes:
        point = self._key.public_key().public_numbers()
        key = {1: 2, 3: -7, -1: 1, -2: point.x.to_bytes(32), -3: point.y.to_bytes(32)}
        return cbor2.dumps(key)
