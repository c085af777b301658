"""Packets of MQTT 3.1.1 as bytes: their bounds, and those that iVeg writes itself."""

PUBLISH, QOS_1, RETAINED, DUPLICATE = 0x30, 0x02, 0x01, 0x08
"""First byte of a PUBLISH, and its flags (section 3.3.1)."""
PUBACK = 0x40
LONGEST_LENGTH = 4
"""Bytes of a remaining length (section 2.2.3)."""


def packet_bounds(data: bytes, start: int) -> tuple[int, int]:
    """Begin and end of the body of the packet at ``start``.

    The end may be behind the data; both are 0 while the fixed header is incomplete.  A
    length that goes on after four bytes is an error: such a packet is the header alone.
    """
    length = shift = 0
    at = start + 1
    for byte in data[at : at + LONGEST_LENGTH]:
        length |= (byte & 0x7F) << shift
        at, shift = at + 1, shift + 7
        if byte < 0x80:
            return at, at + length
    return (at, at) if at == start + 1 + LONGEST_LENGTH else (0, 0)


def publish_packet(
    topic: str, payload: bytes, packet_id: int | None = None, *, retain: bool = False
) -> bytes:
    """A PUBLISH (section 3.3): at QoS 1 if it has a packet identifier, else at 0."""
    name = topic.encode()
    number = b"" if packet_id is None else packet_id.to_bytes(2)
    kind = PUBLISH | (QOS_1 if number else 0) | (RETAINED if retain else 0)
    size = 2 + len(name) + len(number) + len(payload)
    head = bytes((kind,)), remaining_length(size), len(name).to_bytes(2)
    return b"".join((*head, name, number, payload))


def remaining_length(size: int) -> bytes:
    """A remaining length: seven bits a byte, the lowest first (section 2.2.3)."""
    parts = bytearray()
    while size > 127:
        parts.append(size & 127 | 128)
        size >>= 7
    parts.append(size)
    return bytes(parts)
