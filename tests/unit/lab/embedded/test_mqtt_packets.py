"""The bytes of telemetry, spelled out by the rules of MQTT 3.1.1."""

import pytest

from iveg.lab.embedded.mqtt_packets import publish_packet


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


def test_one_at_qos_1_bears_its_number_before_the_payload() -> None:
    packet = publish_packet("/AGI/cmd", b"{}", 0x107, retain=True)

    assert packet == b"\x33\x0e\x00\x08/AGI/cmd\x01\x07{}"
