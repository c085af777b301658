"""Address check: without authentication the embedded parts bind to loopback only."""

from ipaddress import ip_address

from iveg.domain.errors import SettingsError


def require_loopback(setting: str, host: str) -> str:
    """Return the host if it is a loopback address.

    Raises:
        SettingsError: any other address; names the setting.
    """
    if host == "localhost":
        return "127.0.0.1"
    try:
        usable = ip_address(host).is_loopback
    except ValueError:
        usable = False
    if not usable:
        raise SettingsError(
            setting,
            host,
            "a loopback address such as 127.0.0.1, because the embedded FIWARE "
            "asks nobody who they are",
        )
    return host
