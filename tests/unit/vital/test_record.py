from iveg.domain.records import RECORD_TYPES, Record, is_telemetry
from iveg.vital.record import RecordQueue, Waiting
from tests.fakes.records import (
    alert_record,
    audit_record,
    climate_record,
    command_event_record,
    command_record,
    decision_record,
    detection_record,
    log_record,
    measurement_record,
    odometry_record,
)

KEPT = (
    alert_record(),
    audit_record(),
    command_event_record(),
    command_record(),
    decision_record(),
    log_record(),
)


def queue_of(capacity: int, *records: Record) -> RecordQueue:
    queue = RecordQueue(capacity)
    for since, record in enumerate(records):
        queue.enqueue(Waiting(record, 1, float(since)))
    return queue


def records(batch: list[Waiting]) -> list[Record]:
    return [one.record for one in batch]


def test_only_telemetry_may_be_dropped() -> None:
    assert is_telemetry(odometry_record())
    assert is_telemetry(detection_record())
    assert is_telemetry(climate_record())
    assert not any(is_telemetry(record) for record in KEPT)
    assert is_telemetry(measurement_record())
    assert len(RECORD_TYPES) == len(KEPT) + 5


def test_a_full_queue_drops_its_oldest_telemetry_and_counts_it() -> None:
    queue = queue_of(2, *(odometry_record(x=x) for x in (1.0, 2.0, 3.0)))

    assert queue.dropped == 1
    newest = [odometry_record(x=2.0), odometry_record(x=3.0)]
    assert records(queue.dequeue(10)) == newest


def test_telemetry_makes_room_for_what_may_not_be_lost() -> None:
    queue = queue_of(2, odometry_record(), detection_record(), *KEPT)

    assert {*map(type, records(queue.dequeue(10)))} <= {*map(type, KEPT)}
    assert queue.dropped == len(KEPT)


def test_orders_stay_even_when_there_is_no_room() -> None:
    queue = queue_of(1, *KEPT)

    assert records(queue.dequeue(10)) == [command_event_record(), command_record()]
    assert queue.dropped == len(KEPT) - 2


def test_what_is_put_back_stands_where_it_stood() -> None:
    told = [odometry_record(x=x) for x in (1.0, 2.0, 3.0)]
    queue = queue_of(10, *told)

    queue.put_back(queue.dequeue(2))

    assert records(queue.dequeue(10)) == told
