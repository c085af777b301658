"""What is written can be read again, and nothing that comes can break the reader."""

import math
import unicodedata
from dataclasses import replace

import numpy as np
import orjson
from hypothesis import given
from hypothesis import strategies as st

from iveg.domain.errors import UnreadableError
from iveg.domain.feedback import Feedback, FeedbackAlert, SpeedLimit
from iveg.domain.geometry import Box3D, Pose2D, Twist2D
from iveg.domain.observations import (
    Climate,
    CommandAnswer,
    Detection,
    DetectionFrame,
    FeedbackRef,
    HeartbeatProbe,
    Hold,
    LaserScan,
    Navigation,
    Odometry,
    Origin,
    ReportedObstacle,
    SafetyReport,
)
from iveg.domain.wire import MAX_TEXT, clean_text
from iveg.ngsi import codec, names

alphabet = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-_.: áéñ"
texts = st.text(alphabet, min_size=1, max_size=40)
walls = st.floats(0, 4e9).map(lambda wall: round(wall, 3))


def thousandths(low: float, high: float) -> st.SearchStrategy[float]:
    return st.integers(int(low * 1000), int(high * 1000)).map(lambda n: n / 1000)


def stamped(boot: str, seq: int, wall: float) -> Origin:
    stamp = codec.format_stamp(wall)
    return Origin(boot, seq, stamp, codec.parse_stamp(stamp))


origins = st.builds(stamped, texts, st.integers(0, 2**53), walls)
told_monos = st.none() | thousandths(0, 1e9)
refs = st.builds(FeedbackRef, texts, st.integers(0, 2**53))
heard = st.none() | refs


@given(origins, told_monos, st.booleans(), heard, st.lists(refs, max_size=3))
def test_what_proves_an_age_survives_the_wire(
    origin: Origin,
    mono: float | None,
    acknowledgements: bool,
    told: FeedbackRef | None,
    others: list[FeedbackRef],
) -> None:
    said = replace(
        origin,
        mono=mono,
        acknowledgements=acknowledgements,
        heard=told if acknowledgements else None,
        heard_also=tuple(others) if acknowledgements and told else (),
    )
    one = Odometry("AGI", said, Pose2D(0.0, 0.0, 0.0), Twist2D(0.0, 0.0))

    (read,) = codec.read_measure("AGI_odom", codec.write_measure(one)).observations

    assert isinstance(read, Odometry)
    assert read.origin == said


metres = thousandths(-1000, 1000)
poses = st.builds(Pose2D, metres, metres, thousandths(-3.14, 3.14))
twists = st.builds(Twist2D, thousandths(-3, 3), thousandths(-3, 3))
holds = st.builds(
    Hold,
    texts,
    st.sampled_from(["iveg", "boot", "hw", "bumper", "link"]),
    st.sampled_from(["remote", "local", "auto"]),
)
maybe = st.none() | texts
detections = st.builds(
    Detection,
    texts,
    thousandths(0, 1),
    # Shorter than 12 m, and not where nobody knows.
    st.tuples(*[st.tuples(metres, thousandths(0, 11.9))] * 3)
    .map(lambda sides: Box3D(*(end for a, d in sides for end in (a, round(a + d, 3)))))
    .filter(lambda box: any((box.xmin, box.xmax, box.ymin, box.ymax))),
    st.sampled_from([None, "map", "base_link", "camera_optical_frame"]),
    maybe,
)
frames = st.builds(
    DetectionFrame, st.just("AGI"), origins, st.lists(detections).map(tuple)
)
speed_limits = st.builds(
    SpeedLimit,
    st.sampled_from([0.0, 0.5, 1.0]),
    texts,
    maybe,
    thousandths(0, 99),
    maybe,
    st.none() | thousandths(0, 9),
    st.booleans(),
)
alerts = st.builds(
    FeedbackAlert,
    texts,
    texts,
    st.sampled_from(["person", "robot", None]),
    maybe,
    st.none() | thousandths(0, 1),
    st.none() | st.tuples(metres, metres, metres),
    st.none() | thousandths(1, 6),
    maybe,
    st.none() | st.tuples(thousandths(-3, 3), thousandths(-3, 3)),
)


def hundredths(low: float, high: float) -> st.SearchStrategy[float]:
    return st.integers(int(low * 100), int(high * 100)).map(lambda n: n / 100)


obstacles = st.none() | st.builds(
    ReportedObstacle,
    hundredths(-99, 99),
    hundredths(-99, 99),
    hundredths(0, 9),
    st.booleans(),
)


@given(st.builds(Odometry, st.just("AGI"), origins, poses, twists))
def test_odometry_comes_back_as_it_went(value: Odometry) -> None:
    reading = codec.read_measure("AGI_odom", codec.write_measure(value))

    assert reading == codec.ReadResult((value,))


@given(
    st.builds(
        DetectionFrame,
        st.just("AGI"),
        origins,
        st.lists(detections).map(tuple),
        detector=st.none() | texts,
    )
)
def test_detections_come_back_as_they_went(value: DetectionFrame) -> None:
    written = codec.write_measure(value)

    assert codec.read_measure("AGI_yolox_bounding_boxes", written) == codec.ReadResult(
        (value,)
    )


@given(
    st.builds(
        SafetyReport,
        st.just("AGI"),
        origins,
        st.sampled_from([0.0, 0.5, 1.0]),
        st.sampled_from(["clear", "person", "robot", "stale", "hold", "watchdog"]),
        maybe,
        maybe,
        st.lists(holds, max_size=64).map(tuple),
        st.lists(texts, max_size=64).map(tuple),
        maybe,
        thousandths(-3, 3),
        thousandths(-3, 3),
        st.none() | thousandths(0, 100),
        peer_scans=st.booleans(),
        obstacle=obstacles,
    )
)
def test_safety_reports_come_back_as_they_went(value: SafetyReport) -> None:
    assert codec.read_measure(
        "AGI_safety", codec.write_measure(value)
    ) == codec.ReadResult((value,))


@given(
    st.builds(
        Navigation,
        st.just("AGI"),
        origins,
        texts,
        st.none() | st.tuples(metres, metres),
        st.lists(st.tuples(metres, metres), max_size=50).map(tuple),
    )
)
def test_navigation_comes_back_as_it_went(value: Navigation) -> None:
    assert codec.read_measure(
        "AGI_nav", codec.write_measure(value)
    ) == codec.ReadResult((value,))


@given(
    st.builds(
        CommandAnswer,
        st.just("AGI"),
        st.builds(Origin, texts, st.integers(0, 2**53)),
        maybe,
        st.sampled_from(["LATCHED", "RELEASED", "RESUMED", "REFUSED"]),
        st.lists(holds, max_size=8).map(tuple),
        maybe,
        thousandths(-3, 3),
        maybe,
        maybe,
    )
)
def test_answers_come_back_as_they_went(value: CommandAnswer) -> None:
    assert codec.read_answer("AGI", codec.write_answer(value)) == codec.ReadResult(
        (value,)
    )


@given(
    origins,
    poses,
    st.lists(thousandths(0, 30) | st.just(math.inf), max_size=50),
)
def test_scans_come_back_as_they_went(
    origin: Origin, mount: Pose2D, ranges: list[float]
) -> None:
    value = LaserScan(
        "AGI", origin, -1.5, 0.01, 0.1, 30.0, mount, np.array(ranges, np.float32)
    )

    reading = codec.read_measure("AGI_lidar2D", codec.write_measure(value))

    (back,) = reading.observations
    assert isinstance(back, LaserScan)
    assert (back.origin, back.mount, back.range_max) == (origin, mount, 30.0)
    np.testing.assert_allclose(back.ranges, value.ranges, atol=1e-3)


@given(
    st.none() | thousandths(-60, 90),
    st.none() | thousandths(0, 1),
    st.none() | thousandths(0, 5000),
)
def test_climate_comes_back_as_it_went(
    temperature: float | None, humidity: float | None, co2: float | None
) -> None:
    value = Climate(temperature, humidity, co2)
    attributes = orjson.loads(codec.write_climate(value, "t"))

    entity = {"id": names.CLIMATE_ID, "type": names.CLIMATE_TYPE, **attributes}
    assert codec.read_entity(entity) == codec.ReadResult((value,))


@given(origins)
def test_the_heartbeat_comes_back_as_it_went(origin: Origin) -> None:
    attributes = orjson.loads(codec.write_heartbeat(origin))

    entity = {"id": names.HEARTBEAT_ID, "type": names.HEARTBEAT_TYPE, **attributes}
    assert codec.read_entity(entity) == codec.ReadResult((HeartbeatProbe(origin),))


@given(
    st.builds(
        Feedback,
        texts,
        origins,
        st.none() | alerts,
        st.lists(alerts, max_size=5).map(tuple),
        poses,
        twists,
        maybe,
        st.dictionaries(texts, speed_limits, max_size=4),
        st.dictionaries(texts, st.integers(0, 2**53), max_size=4),
        foresight=st.booleans(),
    )
)
def test_feedback_comes_back_as_it_went(value: Feedback) -> None:
    assert codec.read_feedback(codec.write_feedback(value)) == value


# --- junk -------------------------------------------------------------------------

junk = st.recursive(
    st.none()
    | st.booleans()
    | st.integers(-(2**60), 2**60)
    | st.floats(allow_nan=False, allow_infinity=False)
    | st.text(max_size=20),
    lambda inner: (
        st.lists(inner, max_size=4)
        | st.dictionaries(
            st.sampled_from(
                ["x", "y", "yaw", "value", "type", "holds", "path", "position"]
            )
            | st.text(max_size=5),
            inner,
            max_size=4,
        )
    ),
    max_leaves=12,
)
attribute_names = st.sampled_from(
    [name for device in names.ROBOT_DEVICES for name, _ in device.attributes]
    + ["cmd_status", "cmd_info", "cmd"]
)


@given(st.dictionaries(attribute_names, junk, max_size=6))
def test_no_json_in_any_attribute_breaks_the_reader(
    attributes: dict[str, object],
) -> None:
    payload = orjson.dumps(attributes)

    reading = codec.read_measure("AGI", payload)

    assert all(getattr(one, "robot_id", "AGI") == "AGI" for one in reading.observations)


@given(st.binary(max_size=200))
def test_no_bytes_break_the_reader(payload: bytes) -> None:
    codec.read_measure("AGI", payload)
    codec.read_answer("AGI", payload)
    for read in (codec.read_notification, codec.read_feedback):
        try:
            read(payload)
        except UnreadableError:
            continue


@given(st.text(max_size=300))
def test_cleaned_text_is_short_and_clean_and_stays_so(text: str) -> None:
    cleaned = clean_text(text)

    assert len(cleaned) <= MAX_TEXT
    assert clean_text(cleaned) == cleaned
    assert not [mark for mark in cleaned if unicodedata.category(mark)[0] == "C"]
