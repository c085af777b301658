"""Foresight only adds (docs/safety.md, "Foresight")."""

from hypothesis import example, given
from hypothesis import strategies as st

from iveg.domain.detection_rule import DetectionRule
from iveg.domain.feedback import CLEAR, Feedback, FeedbackAlert
from iveg.domain.geometry import Pose2D, Twist2D
from iveg.domain.observations import Origin
from iveg.robot.judgement import Judgement, Limits
from tests.unit.domain.scene import Scene, person
from tests.unit.robot.rig import person as alert

_SPOT = st.tuples(
    st.sampled_from((-3.0, 1.5, 2.4, 3.0, 4.5, 7.0)),
    st.sampled_from((-2.0, 0.0, 0.5, 2.5)),
)
_LONG = tuple((0.05 * n, 0.0) for n in range(100_000))
_ODD_PATHS = (
    (),
    ((0.0, 0.0), (6.0, 0.0)),
    ((0.0, 0.0), (1.0, 0.0), (900.0, -700.0), (1.1, 0.0)),
    ((5000.0, 5000.0), (5001.0, 5000.0)),
    ((2.0, 0.0),) * 50,
    _LONG,
)
_Step = tuple[
    float,
    float,
    list[tuple[float, float]],
    tuple[tuple[float, float], ...] | None,
]
_STEP = st.tuples(
    st.sampled_from((0.1, 0.4, 1.2, 10.0)),
    st.sampled_from((-1.0, 0.0, 0.4, 1.0, 40.0)),
    st.lists(_SPOT, max_size=2),
    st.none() | st.sampled_from(_ODD_PATHS),
)


@given(st.lists(_STEP, max_size=15))
def test_no_robot_is_ever_faster_for_it(
    run: list[_Step],
) -> None:
    scenes = [Scene(rule=DetectionRule(foresight=one)) for one in (False, True)]
    x = 0.0
    for after_s, speed, people, path in run:
        x += min(speed, 1.0) * after_s
        limits = []
        for scene in scenes:
            scene.now = round(scene.now + after_s, 6)
            scene.drive("AGI", x, linear=speed)
            scene.drive("AGII", 3.0, 1.0, linear=-speed)
            if path is not None:
                scene.navigate("AGI", "work", path)
            scene.look("AGI", *(person(*spot) for spot in people))
            scene.look("AGII")
            limits.append(scene.judge())
        before, after = limits
        for robot_id, limit in before.items():
            assert after[robot_id].speed_factor <= limit.speed_factor


@given(st.sampled_from((0.5, 1.0, 2.0)), st.lists(_STEP, min_size=1, max_size=15))
def test_nothing_beyond_the_horizon_of_the_rule_is_foretold(
    horizon_s: float,
    run: list[_Step],
) -> None:
    far, near = Scene(), Scene(rule=DetectionRule(foresight_s=horizon_s))
    for after_s, speed, people, _ in run:
        for scene in (far, near):
            scene.now = round(scene.now + after_s, 6)
            scene.drive("AGI", 0.0, linear=speed)
            scene.look("AGII", *(person(*spot) for spot in people))
            scene.judge()
        kept, every = (_in_s(scene) for scene in (near, far))
        assert kept == {who: s for who, s in every.items() if s <= horizon_s}


def _in_s(scene: Scene) -> dict[str, float]:
    ahead = scene.speed_limits.encounters.get("AGI", {}).items()
    return {cause: one.in_s for cause, one in ahead if one.effect == "slows"}


_TASK = st.sampled_from((None, "waiting", "scouting", "hauling", "sowing"))


_BACK: _Step = (0.1, -1.0, [], None)


@given(st.lists(st.tuples(_STEP, _TASK, _TASK), max_size=15))
@example(
    [
        ((0.1, 1.0, [], None), None, None),
        (_BACK, "waiting", "scouting"),
        *[(_BACK, None, None)] * 4,
        ((0.1, 40.0, [], None), None, None),
        ((0.4, 40.0, [], None), None, None),
        ((10.0, -1.0, [], None), None, None),
    ]
)
def test_no_robot_is_ever_faster_for_a_task(
    run: list[
        tuple[
            _Step,
            str | None,
            str | None,
        ]
    ],
) -> None:
    scenes, x = [Scene(), Scene()], 0.0
    for (after_s, speed, people, _), *tasks in run:
        x += speed * after_s
        limits = []
        for scene in scenes:
            scene.now = round(scene.now + after_s, 6)
            scene.drive("AGI", x, linear=speed)
            scene.drive("AGII", 6.0 - x, 1.0, linear=-speed)
            for robot_id, task in zip(("AGI", "AGII"), tasks, strict=True):
                if task and scene is scenes[1]:
                    scene.navigate(robot_id, task)
            scene.look("AGI", *(person(*spot) for spot in people))
            scene.look("AGII")
            limits.append(scene.judge())
        for robot_id, limit in limits[0].items():
            assert limits[1][robot_id].speed_factor <= limit.speed_factor


_SEEN = st.tuples(
    st.sampled_from((-3.0, 1.5, 2.4, 3.0, 4.5, 9.0)),
    st.none() | st.tuples(st.sampled_from((-1.6, 0.0, 1.0)), st.just(0.2)),
)
_LEG = st.tuples(
    st.sampled_from((-1.0, 0.0, 1.0)),
    st.booleans(),
    st.lists(_SEEN, max_size=2),
    st.lists(st.tuples(st.sampled_from((0.0, 2.0, float("nan"), 1e6)), st.just(0.1))),
)


@given(st.lists(_LEG, max_size=10))
def test_no_robot_makes_itself_faster_by_it(
    run: list[
        tuple[
            float,
            bool,
            list[tuple[float, tuple[float, float] | None]],
            list[tuple[float, float]],
        ]
    ],
) -> None:
    today, ahead = (Judgement("AGI", 0.0, Limits()) for _ in range(2))
    seq, now = 0, 0.0
    for x, speaks, people, path in run:
        seen = tuple(
            alert(there, decision_id=f"d-{number}", velocity=goes)
            for number, (there, goes) in enumerate(people)
        )
        for _ in range(8):
            seq, now = seq + 1, round(now + 0.1, 6)
            for one, foresight in ((today, False), (ahead, True)):
                # Whoever is slowed reports at once, which also proves ages sooner.
                one.watchdog.sent(seq, now)
                one.note_odometry(Pose2D(x, 0.0, 0.2), Twist2D(0.8, 0.1), now)
                one.note_path(path, now)
                if speaks:
                    one.note_feedback("AGII", _told(seq, seen, foresight), now)
                one.settle(now)
            assert ahead.cap.factor <= today.cap.factor


def _told(seq: int, seen: tuple[FeedbackAlert, ...], foresight: bool) -> Feedback:
    return Feedback(
        "AGII",
        Origin("cloud", seq),
        alerts=seen,
        pose=Pose2D(6.0, 1.0, 3.1),
        twist=Twist2D(0.7, 0.0),
        pose_stamp=f"{seq}",
        speed_limits={"AGI": CLEAR},
        seen={"AGI": seq},
        foresight=foresight,
    )
