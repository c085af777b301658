"""Does the judge of slow-downs raise false alarms while FIWARE comes and goes?

``python -m benchmarks.outages [MINUTES] [OUTAGES]`` (60, 10).  Two emulated robots that
always obey drive among four people; Mosquitto is bridged to the embedded FIWARE, which
is frozen for a while and killed and started, in turns.  So every P1 that says that a
robot does not slow is false.  Exit status 1 where one was raised.
"""

import sys
import tempfile
import time
from collections import Counter
from pathlib import Path
from typing import Any

from benchmarks.process import machine, pause, print_table
from tests.chaos.field import Field
from tests.processes import Site, site

_FROZEN_S, _STARTS_S = 80.0, 5.0
_JUDGED = ("alert.person_not_slowing", "alert.no_slow_down")
_SCENARIO = ("--scenario", "demo")


def main() -> int:
    """Drive, break, and count what was raised."""
    words = [float(one) for one in sys.argv[1:]]
    minutes, outages = (*words, 60.0, 10.0)[:2] if len(words) != 1 else (*words, 10.0)
    print(machine())
    with tempfile.TemporaryDirectory() as folder, site(Path(folder)) as place:
        field = Field(place, *_SCENARIO)
        try:
            field.start_all()
            for number in range(int(outages)):
                _break(field, number, minutes * 60.0 / outages)
            return _told(place)
        finally:
            place.stop_all()
            field.close()


def _break(field: Field, number: int, every_s: float) -> None:
    """One outage in the middle of its time."""
    began = time.monotonic()
    pause(every_s / 3)
    if number % 2:
        field.kill("fiware")
        pause(_STARTS_S)
        field.start("fiware")
    else:
        field.freeze("fiware")
        pause(min(_FROZEN_S, every_s / 3))
        field.thaw("fiware")
    pause(max(0.0, every_s - (time.monotonic() - began)))


def _told(place: Site) -> int:
    with place.api() as api:
        alerts = _all(api, "alerts")
        decisions = _all(api, "decisions")
    seen = sum(one["observed_at"] is not None for one in decisions)
    raised = Counter((one["priority"], one["key"]) for one in alerts)
    rows = [[priority, key, str(n)] for (priority, key), n in sorted(raised.items())]
    print_table("Alerts", ["priority", "alert", "raised"], rows)
    print(f"{len(decisions)} decisions, {seen} seen in the speed of a robot")
    false = [one for one in alerts if one["key"] in _JUDGED]
    for one in false:
        print(one)
    return 1 if false else 0


def _all(api: Any, what: str) -> list[dict[str, Any]]:
    """All rows of a list, page by page."""
    rows: list[dict[str, Any]] = []
    cursor = ""
    while True:
        page = api.get(f"{what}?limit=500{cursor}").raise_for_status().json()
        rows += page["items"]
        if not page.get("next"):
            return rows
        cursor = f"&cursor={page['next']}"


if __name__ == "__main__":
    sys.exit(main())
