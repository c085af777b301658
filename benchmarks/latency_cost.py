"""Cost of timing every message, at twenty robots of ninety messages a second.

Run ``python -m benchmarks.latency_cost``.  Each message passes both taps and the loop
(three calls); each second ticks twenty times.  Time is that of the processor, so that
a busy machine measures the same.  The goal is 5 % of a core.
"""

import time

from iveg.domain.geometry import Pose2D, Twist2D
from iveg.domain.latency import LatencyWatch, collect, merge
from iveg.domain.observations import (
    FeedbackRef,
    Instant,
    Odometry,
    Origin,
    Received,
)
from iveg.domain.transports import DIRECT
from iveg.domain.world import FeedbackLedger

ROBOTS, HZ, SECONDS, TICKS = 20, 90, 70, 20
GOAL_SHARE = 0.05
WALL = 1_800_000_000.0


def main() -> None:
    robots = tuple(f"R{number}" for number in range(ROBOTS))
    ledger = FeedbackLedger()
    watch = LatencyWatch(robots, ledger.composed_at)
    spent = ticked = 0.0
    for second in range(SECONDS):
        for part in range(TICKS):
            now = second + part / TICKS
            ledger.composed("i", second * TICKS + part, second * TICKS + part, now)
            batch = _messages(robots, second * TICKS + part, now)
            began = time.thread_time()
            for heard, notified in batch:
                watch.arrived(heard)
                watch.arrived(notified)
            watch.decided([heard for heard, _ in batch], Instant(now, WALL + now))
            between = time.thread_time()
            watch.tick(Instant(now, WALL + now))
            ticked += time.thread_time() - between
            spent += between - began
    messages = ROBOTS * HZ * SECONDS
    began = time.thread_time()
    parts = collect(watch.streams.values())
    collected = time.thread_time() - began
    for sketch in merge(parts).values():
        sketch.quantile(0.95)
    answered = time.thread_time() - began
    share = (spent + ticked) / SECONDS
    print("| what | cost |\n|---|---|")
    print(f"| a message, both taps and the loop | {1e6 * spent / messages:.1f} µs |")
    print(f"| ticks, of a second | {1e3 * ticked / SECONDS:.1f} ms |")
    print(f"| all of it, of one core | {100 * share:.1f} % (goal {GOAL_SHARE:.0%}) |")
    print(f"| an answer over 15 min, in the loop | {1e3 * collected:.1f} ms |")
    print(f"| an answer over 15 min, in all | {1e3 * answered:.1f} ms |")


def _messages(
    robots: tuple[str, ...], number: int, now: float
) -> list[tuple[Received, Received]]:
    """Those of one tick: as many as make the rate."""
    out = []
    for robot_id in robots:
        for one in range(HZ // TICKS + (number % TICKS < HZ % TICKS)):
            seq = number * (HZ // TICKS + 1) + one
            stamp = WALL + now + 0.001 * one - 0.004
            heard = FeedbackRef("i", number)
            origin = Origin("b", seq, "", stamp, now, True, heard)
            told = Odometry(robot_id, origin, Pose2D(0, 0, 0), Twist2D(0, 0))
            at = Instant(now + 0.001 * one, WALL + now + 0.001 * one)
            out.append((Received(told, at, DIRECT.id), Received(told, at.later(0.02))))
    return out


if __name__ == "__main__":
    main()
