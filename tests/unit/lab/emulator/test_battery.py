from iveg.lab.emulator.emulated_robot import battery_after
from iveg.pipeline.kinds import KINDS

TWENTY_MINUTES_S, TWO_DAYS_S = 1_200, 172_800


def test_an_emulated_battery_drains_and_never_raises_an_alert() -> None:
    (low,) = (row.low for row in KINDS if row.low is not None)
    levels = [battery_after(float(s)).percentage for s in range(0, TWO_DAYS_S, 60)]

    assert battery_after(TWENTY_MINUTES_S).percentage == 0.908
    assert all(level is not None and low.above < level <= 1.0 for level in levels)
