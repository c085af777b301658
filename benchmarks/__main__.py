"""Run every benchmark that takes minutes, not longer: ``python -m benchmarks``.

``python -m benchmarks.soak`` is a run of its own (``make soak``).
"""

import runpy

BENCHMARKS = (
    "latency_cost",
    "lidar_cost",
    "fiware_transport",
    "notify_cost",
    "rule_cost",
    "ros2_cost",
    "sign_in_flood",
    "glass",
)


def main() -> None:
    for name in BENCHMARKS:
        runpy.run_module(f"benchmarks.{name}", run_name="__main__")


if __name__ == "__main__":
    main()
