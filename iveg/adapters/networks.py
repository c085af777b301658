"""Networks that addresses belong to."""

from ipaddress import IPv6Address, ip_address


def network_of(address: str) -> str:
    """Whom an address belongs to: of IPv6 the first 64 bits, which one host may have.

    Anything that is no address stands for itself, cut.
    """
    try:
        read = ip_address(address.partition("%")[0])
    except ValueError:
        return address[:64]
    if not isinstance(read, IPv6Address):
        return address
    if read.ipv4_mapped is not None:
        return str(read.ipv4_mapped)
    return str(IPv6Address(int(read) >> 64 << 64))
