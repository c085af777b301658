"""Counts of the server's parts, for metrics and the Fleet page."""

from collections import Counter
from collections.abc import Iterable, Mapping

from iveg.adapters.history.recorder import Recorder
from iveg.adapters.mqtt import MqttLink
from iveg.pipeline import Pipeline
from iveg.web.api import health


def count_all(
    pipeline: Pipeline, recorder: Recorder, beside: Iterable[Mapping[str, int]]
) -> Counter[str]:
    """All counters: of the pipeline, the history and the parts beside."""
    total = pipeline.counters()
    for counted in (recorder.counters, *beside):
        total.update(counted)
    return total


def read_queues(
    pipeline: Pipeline, recorder: Recorder, link: MqttLink
) -> health.Queues:
    """Depth of each queue, messages dropped from it, and repeated attempts."""
    ingest, kept = pipeline.ingest, recorder.counters
    dropped = {
        "ingest": sum(
            n for name, n in ingest.counters.items() if name.startswith("dropped.")
        ),
        "history": kept["history_dropped"],
        "mqtt_out": link.replaced,
    }
    stops = [machine.stop for machine in pipeline.commander.machines.values()]
    retries = {
        "broker_connect": max(0, link.connects - 1),
        "stop_send": sum(max(0, one.tries - 1) for one in stops if one is not None),
    }
    depths = {
        "ingest": ingest.waiting,
        "history": kept["history_waiting"],
        "mqtt_out": link.offered,
    }
    return health.Queues(depths, dropped, retries)
