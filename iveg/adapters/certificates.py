"""Certificates of a site's own authority: of its broker, its robots and iVeg (X.509).

What is good for a while yet is kept, what is missing or ends soon is made: the same
call renews.  The common name says who comes; it is the user in the access list.
"""

import os
from collections.abc import Iterable
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from ipaddress import ip_address
from pathlib import Path
from typing import Final

from cryptography import x509
from cryptography.exceptions import InvalidSignature
from cryptography.hazmat.primitives import hashes
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.hazmat.primitives.serialization import (
    Encoding,
    NoEncryption,
    PrivateFormat,
    load_pem_private_key,
)
from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID

AUTHORITY_DAYS: Final = 3650
DAYS: Final = 397
"""Of a broker or a robot."""
RENEW_DAYS: Final = 30
"""So long before its end a new one is made."""
_EARLIER: Final = timedelta(hours=1)
"""Clocks of robots may be behind."""


@dataclass(frozen=True, slots=True)
class CertificateAuthority:
    """Signs for a site; ``now`` is the time (UTC)."""

    key: ec.EllipticCurvePrivateKey
    certificate: x509.Certificate
    now: datetime

    @classmethod
    def of(cls, folder: Path, now: datetime | None = None) -> "CertificateAuthority":
        """The one in a folder (``ca.crt``, ``ca.key``), made where there is none."""
        now, key_file = now or datetime.now(UTC), folder / "ca.key"
        if key_file.exists():
            key = load_pem_private_key(key_file.read_bytes(), None)
            if not isinstance(key, ec.EllipticCurvePrivateKey):
                raise ValueError(f"{key_file} is no key of this program")
            known = x509.load_pem_x509_certificate((folder / "ca.crt").read_bytes())
            return cls(key, known, now)
        key, name = ec.generate_private_key(ec.SECP256R1()), _named("iVeg")
        made = (
            _begun(name, name, key, now, AUTHORITY_DAYS)
            .add_extension(x509.BasicConstraints(True, 0), critical=True)
            .sign(key, hashes.SHA256())
        )
        write_secret(folder / "ca.crt", made.public_bytes(Encoding.PEM))
        write_secret(key_file, _pem(key))
        return cls(key, made, now)

    @property
    def pem(self) -> bytes:
        """The certificate that everybody trusts."""
        return self.certificate.public_bytes(Encoding.PEM)

    def issue(self, name: str, folder: Path, hosts: Iterable[str] = ()) -> bool:
        """Have ``{name}.crt`` and ``{name}.key`` there; whether they are new.

        Args:
            name: Common name.
            folder: Where they go.
            hosts: Names and addresses of a server; none for a client.
        """
        file, key_file, hosts = folder / f"{name}.crt", folder / f"{name}.key", [*hosts]
        if key_file.exists() and file.exists() and self._lasts(file, hosts):
            return False
        key = ec.generate_private_key(ec.SECP256R1())
        oid = ExtendedKeyUsageOID
        use = oid.SERVER_AUTH if hosts else oid.CLIENT_AUTH
        issuer = self.certificate.subject
        begun = (
            _begun(_named(name), issuer, key, self.now, DAYS)
            .add_extension(x509.BasicConstraints(False, None), critical=True)
            .add_extension(x509.ExtendedKeyUsage([use]), critical=False)
        )
        if hosts:
            begun = begun.add_extension(_reached_at(hosts), critical=False)
        made = begun.sign(self.key, hashes.SHA256())
        write_secret(file, made.public_bytes(Encoding.PEM))
        write_secret(key_file, _pem(key))
        return True

    def revoked(self, files: Iterable[Path]) -> bytes:
        """A list of revoked certificates (CRL in PEM) that holds exactly these."""
        begun = (
            x509.CertificateRevocationListBuilder()
            .issuer_name(self.certificate.subject)
            .last_update(self.now - _EARLIER)
            .next_update(self.now + timedelta(days=AUTHORITY_DAYS))
        )
        for file in files:
            serial = x509.load_pem_x509_certificate(file.read_bytes()).serial_number
            entry = x509.RevokedCertificateBuilder(serial, self.now)
            begun = begun.add_revoked_certificate(entry.build())
        return begun.sign(self.key, hashes.SHA256()).public_bytes(Encoding.PEM)

    def _lasts(self, file: Path, hosts: list[str]) -> bool:
        """Whether it is ours, for these hosts, and good for a while."""
        known = x509.load_pem_x509_certificate(file.read_bytes())
        kind = x509.SubjectAlternativeName
        named = [one.value for one in known.extensions if isinstance(one.value, kind)]
        wanted = [_reached_at(hosts)] if hosts else []
        left = known.not_valid_after_utc - self.now
        try:
            known.verify_directly_issued_by(self.certificate)
        except (InvalidSignature, ValueError):
            return False
        return named == wanted and left > timedelta(days=RENEW_DAYS)


def write_secret(file: Path, body: bytes) -> None:
    """Replace a file whole, readable by its owner alone."""
    file.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
    new = file.with_name(file.name + ".new")
    new.unlink(missing_ok=True)
    with os.fdopen(
        os.open(new, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "wb"
    ) as to:
        to.write(body)
    new.replace(file)


def _begun(
    subject: x509.Name,
    issuer: x509.Name,
    key: ec.EllipticCurvePrivateKey,
    now: datetime,
    days: int,
) -> x509.CertificateBuilder:
    return (
        x509.CertificateBuilder()
        .subject_name(subject)
        .issuer_name(issuer)
        .public_key(key.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(now - _EARLIER)
        .not_valid_after(now + timedelta(days=days))
    )


def _named(name: str) -> x509.Name:
    return x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, name)])


def _reached_at(hosts: Iterable[str]) -> x509.SubjectAlternativeName:
    return x509.SubjectAlternativeName([_host(one) for one in hosts])


def _host(host: str) -> x509.GeneralName:
    try:
        return x509.IPAddress(ip_address(host))
    except ValueError:
        return x509.DNSName(host)


def _pem(key: ec.EllipticCurvePrivateKey) -> bytes:
    return key.private_bytes(Encoding.PEM, PrivateFormat.PKCS8, NoEncryption())
