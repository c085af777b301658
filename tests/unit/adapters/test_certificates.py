"""Certificates of a site: kept while they last, renewed before they end."""

import ssl
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest

from iveg.adapters.certificates import DAYS, RENEW_DAYS, CertificateAuthority
from iveg.adapters.tls import TlsFiles

NOW = datetime(2026, 5, 1, tzinfo=UTC)


def authority(folder: Path, after_days: float = 0.0) -> CertificateAuthority:
    return CertificateAuthority.of(folder, NOW + timedelta(days=after_days))


@pytest.mark.parametrize(
    ("after_days", "is_new"), [(1, False), (DAYS - RENEW_DAYS + 1, True), (500, True)]
)
def test_a_certificate_is_made_anew_in_time_and_not_before(
    tmp_path: Path, after_days: float, is_new: bool
) -> None:
    first = authority(tmp_path).issue("AGI", tmp_path)
    again = authority(tmp_path, after_days).issue("AGI", tmp_path)

    assert (first, again) == (True, is_new)


def test_a_broker_with_another_name_and_another_authority_need_new_ones(
    tmp_path: Path,
) -> None:
    ours = authority(tmp_path / "ours")
    ours.issue("broker", tmp_path, ["localhost", "127.0.0.1"])

    assert not ours.issue("broker", tmp_path, ["localhost", "127.0.0.1"])
    assert ours.issue("broker", tmp_path, ["broker.example", "127.0.0.1"])
    assert authority(tmp_path / "theirs").issue("broker", tmp_path, ["broker.example"])


def test_keys_are_readable_by_their_owner_alone(tmp_path: Path) -> None:
    authority(tmp_path / "ca").issue("AGI", tmp_path / "AGI")

    modes = {file.name: file.stat().st_mode & 0o777 for file in tmp_path.rglob("*.key")}
    assert modes == {"ca.key": 0o600, "AGI.key": 0o600}


def test_a_key_that_does_not_fit_is_no_context(tmp_path: Path) -> None:
    ours = authority(tmp_path)
    ours.issue("AGI", tmp_path)
    ours.issue("AGII", tmp_path)
    files = TlsFiles(
        *(str(tmp_path / one) for one in ("ca.crt", "AGI.crt", "AGII.key"))
    )

    with pytest.raises(ssl.SSLError):
        files.context()
