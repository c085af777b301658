"""Run every benchmark that takes minutes, not longer: ``python -m benchmarks``.

``python -m benchmarks.soak`` is a run of its own (``make soak``).
"""

import runpy

BENCHMARKS = (
    "decision_cost",
    "feedback_delay",
    "latency_cost",
    "lidar_cost",
    "emulator_cost",
    "fiware_transport",
    "notify_cost",
    "paint",
    "ros2_cost",
    "sign_in_flood",
    "tracking",
    "glass",
)


def main() -> None:
    for name in BENCHMARKS:
        runpy.run_module(f"benchmarks.{name}", run_name="__main__")


if __name__ == "__main__":
    main()
