from iveg.domain.kinds import SENSED
from iveg.lab.emulator.sensors import battery_after

TWENTY_MINUTES_S, TWO_DAYS_S = 1_200, 172_800


def test_an_emulated_battery_drains_and_never_raises_an_alert() -> None:
    (low,) = (row.sensor.low for row in SENSED if row.sensor and row.sensor.low)
    levels = [battery_after(float(s)).percentage for s in range(0, TWO_DAYS_S, 60)]

    assert battery_after(TWENTY_MINUTES_S).percentage == 0.908
    assert all(level is not None and low.above < level <= 1.0 for level in levels)
