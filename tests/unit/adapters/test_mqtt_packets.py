"""The bytes of telemetry, spelled out by the rules of MQTT 3.1.1."""

import pytest

from iveg.adapters.mqtt_packets import publish_packet


def test_a_packet_is_a_publish_that_nobody_confirms() -> None:
    packet = publish_packet("/iveg/AGI_odom/attrs", b"{}")

    assert packet == b"\x30\x18\x00\x14/iveg/AGI_odom/attrs{}"


@pytest.mark.parametrize(
    ("size", "length"),
    [
        (127, "7f"),
        (128, "8001"),
        (16_383, "ff7f"),
        (16_384, "808001"),
        (2_097_152, "80808001"),
    ],
)
def test_a_length_takes_seven_bits_a_byte(size: int, length: str) -> None:
    packet = publish_packet("t", bytes(size - 3))

    assert packet[1:].hex().startswith(length + "0001")


def test_a_topic_is_counted_in_bytes() -> None:
    assert publish_packet("ä", b"").hex() == "300400" + "02" + "c3a4"


def test_one_at_qos_1_bears_its_number_before_the_payload() -> None:
    packet = publish_packet("/AGI/cmd", b"{}", 0x107, retain=True)

    assert packet == b"\x33\x0e\x00\x08/AGI/cmd\x01\x07{}"
