"""Seeded mistakes in STOP, the rule and freshness: the tests must notice every one.

``make mutants`` makes each in a copy of the tree, runs the tests that are there to
catch it and expects them to fail.  A mutant names its text, not its file, so that code
may move; ``tests/architecture/test_mutants.py`` says when the text itself has changed.
"""

import os
import shutil
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

from tests.processes import ROOT

_COPIED = ("iveg", "tests", "migrations", "docs", "pyproject.toml")
_FAILED = 1
"""Exit status of pytest where tests ran and some failed."""


@dataclass(frozen=True, slots=True)
class Mutant:
    """One mistake.

    Attributes:
        says: What is wrong with it.
        right: Text that stands once in ``iveg``; ``wrong`` takes its place.
        tests: Files or folders below ``tests`` of which one test at least must fail.
    """

    says: str
    right: str
    wrong: str
    tests: tuple[str, ...]

    @property
    def file(self) -> Path:
        """Where it is, relative to the root of the tree."""
        found = [
            file
            for file in sorted((ROOT / "iveg").rglob("*.py"))
            if self.right in file.read_text()
        ]
        if len(found) != 1 or found[0].read_text().count(self.right) != 1:
            raise LookupError(f"stands not once in iveg: {self.right!r}")
        return found[0].relative_to(ROOT)


MUTANTS = (
    Mutant(
        "STOP: standing is believed before it has lasted",
        "return enough and lasted >= LIMITS.standing_for_s",
        "return enough",
        ("unit/domain/test_stop.py",),
    ),
    Mutant(
        "STOP: a robot's own clock alone says how long it has stood",
        "lasted = min(newest.since(began), arrived_s)",
        "lasted = newest.since(began)",
        ("unit/domain/test_standstill.py",),
    ),
    Mutant(
        "STOP: odometry that still moves does not contradict a standstill",
        "and not self._wheels_moved(moment)",
        "",
        ("unit/domain/test_stop.py",),
    ),
    Mutant(
        "STOP: a robot lets go whoever knows one of its holds",
        "if not remote <= set(order.ids):",
        "if not remote & set(order.ids):",
        ("unit/robot/test_safety.py",),
    ),
    Mutant(
        "STOP: an old release is as good as a new one",
        "if order.challenge != self._challenge:",
        "if not order.challenge:",
        ("unit/robot/test_safety.py",),
    ),
    Mutant(
        "STOP: a robot that still moves may be released",
        'return None if self._judgement.stands(now) else "not_standing"',
        "return None",
        ("unit/robot/test_safety.py",),
    ),
    Mutant(
        "STOP: a robot that was stopped while it drove drives on when it is released",
        'if hold.ack != "auto":',
        'if hold.ack == "local":',
        ("unit/robot/test_safety.py",),
    ),
    Mutant(
        "STOP: holds are forgotten by a reboot",
        '_SURVIVES_REBOOT = frozenset({"iveg", "hw", "bumper"})',
        '_SURVIVES_REBOOT = frozenset({"hw", "bumper"})',
        ("unit/robot",),
    ),
    Mutant(
        "STOP: the second copy of a refused release is judged anew",
        "verdict = self._verdicts.get(order.attempt)",
        "verdict = None",
        ("unit/robot/test_safety.py",),
    ),
    Mutant(
        "rule: what the laser sees near a robot slows nobody",
        "return self.size_m <= _LARGEST_M or self.way_m > _MOVED_M",
        "return False",
        ("unit/domain/test_laser.py", "unit/robot/test_safety.py"),
    ),
    Mutant(
        "rule: one reason that is over ends the limit of all",
        "all(entry.outside_since is not None for entry in entries.values())",
        "any(entry.outside_since is not None for entry in entries.values())",
        ("unit/domain/rule/test_judge.py",),
    ),
    Mutant(
        "rule: an encounter that is foretold slows nobody",
        "item.zone.cause for item in on_path if item.in_s <= soon_s",
        "item.zone.cause for item in on_path if False",
        ("unit/domain/rule/test_foresight.py",),
    ),
    Mutant(
        "rule: people are foretold to stay where they are",
        "return MovingZone(zone.x, zone.y, sighting.vx, sighting.vy, age, radius)",
        "return MovingZone(zone.x, zone.y, 0.0, 0.0, age, radius)",
        ("unit/domain/rule/test_foresight.py",),
    ),
    Mutant(
        "rule: leaves, and a plan that is off, are people for the laser",
        "PLAN_M = 0.4",
        "PLAN_M = 0.1",
        ("unit/domain/test_laser.py",),
    ),
    Mutant(
        "STOP: an old refusal ends the release that is under way",
        "if answer.attempt != self.attempt.command.command_id:",
        "if False:",
        ("unit/domain/test_stop_release.py",),
    ),
    Mutant(
        "STOP: one refused copy ends a release that another may still carry out",
        "if self.refused is None or not self.is_spent(report):",
        "if self.refused is None:",
        ("unit/domain/test_stop_release.py",),
    ),
    Mutant(
        "STOP: a hold that a late release may still lift is held on to for good",
        "return min(since_report, now.mono - self._begun_at) > LIMITS.report_fresh_s",
        "return False",
        ("unit/domain/test_stop_release.py",),
    ),
    Mutant(
        "STOP: a restart asserts a hold that a release has named",
        "if self.hold_id in self.named:",
        "if self.hold_id in self.open_release[1:]:",
        ("properties/test_stop_transports.py",),
    ),
    Mutant(
        "rule: exactly the threshold is no longer enough",
        "if confidence < self.threshold.for_class(class_):",
        "if confidence <= self.threshold.for_class(class_):",
        ("unit/domain",),
    ),
    Mutant(
        "rule: exactly on the border of a zone is outside",
        "elif outside_m <= 0.0:",
        "elif outside_m < 0.0:",
        ("unit/domain/rule/test_judge.py",),
    ),
    Mutant(
        "rule: of two zones the one that is farther away slows a robot",
        "if known is None or distance.outside_m < known.outside_m:",
        "if known is None or distance.outside_m > known.outside_m:",
        ("unit/domain/rule/test_judge.py",),
    ),
    Mutant(
        "rule: a robot is let go on the border, at every flutter",
        "    if outside_m > LIMITS.release_beyond_m:",
        "    if outside_m > 0.0:",
        ("unit/domain/rule/test_judge.py",),
    ),
    Mutant(
        "freshness: any feedback is fresh when it comes, however old its evidence",
        "evidence = self.sent_at(seq)",
        "evidence = now",
        ("unit/robot/test_feedback.py",),
    ),
    Mutant(
        "freshness: a robot without a pose of its own drives as if it had one",
        "if motion is None or now - motion.at > LIMITS.pose_stand_s:",
        "if motion is None:",
        ("unit/robot/test_safety.py",),
    ),
    Mutant(
        "freshness: a message that comes again is news",
        "if seq <= self.seq:",
        "if seq < self.seq - 1:",
        ("unit/domain/test_order.py",),
    ),
    Mutant(
        "freshness: a robot that is not seen keeps its speed",
        "if age is None or age > LIMITS.silence_s:",
        "if age is None:",
        ("unit/domain/rule/test_judge.py",),
    ),
    Mutant(
        "clear: a doubt concerns nobody",
        "if observer.doubts.active(now):",
        "if False:",
        ("unit/domain/rule/test_clear.py",),
    ),
    Mutant(
        "clear: a detector is not waited for",
        "if detector.is_missing(now) if is_required else detector.is_flawed(now):",
        "if detector.is_flawed(now):",
        ("unit/domain/rule/test_clear.py",),
    ),
    Mutant(
        "clear: a refused frame is forgotten",
        "return now.mono - max(newest, default=-math.inf) <= LIMITS.silence_s",
        "return False",
        ("unit/domain/rule/test_clear.py",),
    ),
    Mutant(
        "clear: what is missing concerns its own robot alone",
        "~is_far.all(axis=(0, 3)) & (maps[:, None] == maps)",
        "np.eye(len(robots), dtype=np.bool_)",
        ("unit/domain/rule/test_clear.py",),
    ),
    Mutant(
        "clear: a frame with somebody who could not be placed is whole",
        'if unplaced:\n            return "unreadable" if has_pose',
        'if False:\n            return "unreadable" if has_pose',
        ("unit/domain/test_detector.py",),
    ),
    Mutant(
        "clear: whom a feedback does not name has no limit",
        "feedback.speed_limits.get(self._me, UNSUPERVISED)",
        "feedback.speed_limits.get(self._me, SpeedLimit(1.0))",
        ("unit/robot/test_feedback.py",),
    ),
    Mutant(
        "clear: a frame of another clock proves that a detector works",
        "if abs(transit - odometry.newest) > LIMITS.zone_lasts_s:",
        "if False:",
        ("unit/domain/test_clocks.py",),
    ),
    Mutant(
        "clear: an operator's word on a detector outlives the robot's boot",
        "if ended is None or boot is None or boot == ended.boot:",
        "if True:",
        ("unit/domain/test_detector.py",),
    ),
    Mutant(
        "clear: a frame that a full queue drops is as if it never came",
        "if kind is DetectionFrame:\n            refused = replace(",
        "if False:\n            refused = replace(",
        ("unit/vital/test_ingest.py",),
    ),
    Mutant(
        "clear: a frame that cannot be read is as if it never came",
        "return _refused_frame(source, read) if name in _FRAMES else read",
        "return read",
        ("unit/ngsi",),
    ),
    Mutant(
        "STOP: a report of unknown age confirms a release",
        "if isinf(age_s) and hold_id not in {hold.id for hold in report.holds}:",
        "if False:",
        ("unit/vital/test_age.py",),
    ),
    Mutant(
        "freshness: feedback of another start of iVeg proves an age",
        "return echo.boot == self._boot and echo.seq <= self._last",
        "return echo.seq <= self._last",
        ("unit/domain/test_age.py",),
    ),
    Mutant(
        "freshness: another boot of a robot inherits the proof of the one before",
        "origin.boot is None or origin.boot != before.origin.boot:",
        "False:",
        ("unit/domain/test_world.py",),
    ),
    Mutant(
        "freshness: what FIWARE alone brings is as young as its stamp says",
        "lag = self._probe.lag(at) if self._probe.is_known else None",
        "lag = 0.0",
        ("unit/domain/test_world.py",),
    ),
    Mutant(
        "STOP: a standstill is told by reports however old they are",
        "if self.evidence_age(at) > LIMITS.report_stale_s:",
        "if False:",
        ("unit/vital/test_age.py",),
    ),
    Mutant(
        "STOP: a hold is adopted from a report however old it is",
        "own_holds and self.evidence.evidence_age(at) <= LIMITS.report_stale_s",
        "own_holds",
        ("unit/vital/test_earlier_boots.py",),
    ),
    Mutant(
        "STOP: what an earlier boot reported acts",
        "return not present_boot.is_past(origin.boot, proven_at)",
        "return True",
        ("properties/test_earlier_boots.py",),
    ),
    Mutant(
        "freshness: a straggler of an earlier boot holds up the present one",
        "if proven_at is not None and proven_at > self._began and not self._is_proven:",
        "if False:",
        ("properties/test_earlier_boots.py",),
    ),
    Mutant(
        "STOP: motion from before the rest contradicts it when it comes late",
        "if began is None or moment.boot is None:",
        "if True:",
        ("unit/domain/test_standstill.py",),
    ),
    Mutant(
        "vital: a drawing shares the fate of STOP",
        'return {"mqtt": link.run, "rule-loop": loop.run}',
        'return {"mqtt": link.run, "rule-loop": loop.run, '
        '"costmap": partial(_tick, self.pipeline.mapper.tick, 0.05)}',
        ("unit/app",),
    ),
    Mutant(
        "vital: a failure of comfort is its caller's",
        "            self.failed(part, error)\n\n    def failed",
        "            raise\n\n    def failed",
        ("unit/vital/test_supervision.py",),
    ),
    Mutant(
        "vital: a part ends without a last word to the robots",
        "await _say(last_word)",
        "",
        ("unit/vital/test_life.py",),
    ),
    Mutant(
        "vital: a scan that cannot be taken in ends the rule loop",
        "if kind(observation).vital:",
        "if True:",
        ("unit/vital/test_supervision.py",),
    ),
    Mutant(
        "rule: a box without a frame counts in base_link alone",
        "return _EITHER if described is None else (described,)",
        'return (described or "base_link",)',
        ("unit/domain/tracking/test_frames.py",),
    ),
    Mutant(
        "rule: a camera that nobody described counts as mounted in base_link",
        "if frame is None or not profile.has_known_camera:",
        "if frame is None:",
        ("unit/domain/test_frames.py",),
    ),
    Mutant(
        "rule: somebody without a place slows nobody",
        "self.unplaced += _may_be_somebody(detection, verdict, judged.rule)",
        "self.unplaced += 0",
        ("unit/vital/test_frames.py",),
    ),
    Mutant(
        "clear: a robot may be at any place outside",
        "if bounds is not None and not bounds.contains(pose.x, pose.y):",
        "if False:",
        ("unit/domain/test_contradictions.py",),
    ),
    Mutant(
        "clear: a robot may have any speed",
        "return _SPEED_SHARE * robot.profile.max_speed + _SPEED_M_S",
        "return 1e9",
        ("unit/domain/test_contradictions.py",),
    ),
    Mutant(
        "clear: small steps of a robot add up to any distance",
        "if jumped or at - anchor.at >= _ANCHOR_S:",
        "if True:",
        ("unit/domain/test_contradictions.py",),
    ),
    Mutant(
        "authors: whoever speaks frees robots that another has fallen silent about",
        "if author.is_silent(self._slow_s, now):",
        "if False:",
        ("properties/test_robot_safety.py",),
    ),
    Mutant(
        "authors: a count that goes on nowhere is dropped, not another author's",
        "seq <= author.peer_feedback.newest(topic) and feedback in author.recent",
        "seq <= author.peer_feedback.newest(topic)",
        ("unit/robot/test_feedback.py",),
    ),
    Mutant(
        "authors: with more than there is room for robots are as fast as with few",
        "self._crowded_at = now",
        "pass",
        ("unit/robot/test_feedback.py",),
    ),
    Mutant(
        "clear: a pose and a twist that contradict each other are believed",
        "self._doubt(robot, moved, at, LASTED_S)",
        "pass",
        ("unit/domain/test_contradictions.py",),
    ),
    Mutant(
        "clear: whoever contradicts itself finds a spot empty",
        "if self.detections_at is None or not self.is_believed(now):",
        'if self.detections_at is None or self.link(now) != "LIVE":',
        ("unit/domain/tracking/test_sight.py",),
    ),
    Mutant(
        "clear: a message that names another robot counts for its topic's",
        """if isinstance(part, dict) and part.get("robot_id", robot_id) != robot_id:""",
        "if False:",
        ("unit/ngsi/test_codec_hostile.py",),
    ),
)


def is_caught(mutant: Mutant) -> bool:
    """Whether a test fails with the mistake; tests that cannot run catch nothing."""
    with tempfile.TemporaryDirectory(prefix="iveg-mutant-") as name:
        tree = Path(name)
        for part in _COPIED:
            _copy(ROOT / part, tree / part)
        file = tree / mutant.file
        file.write_text(file.read_text().replace(mutant.right, mutant.wrong))
        return _status(tree, mutant.tests) == _FAILED


def _copy(source: Path, target: Path) -> None:
    if source.is_dir():
        ignored = shutil.ignore_patterns("__pycache__")
        shutil.copytree(source, target, ignore=ignored)
    else:
        shutil.copy(source, target)


def _status(tree: Path, tests: tuple[str, ...]) -> int:
    words = ("-x", "-q", "-p", "no:cacheprovider", "-p", "no:xdist", "-m", "not real")
    return subprocess.run(
        [sys.executable, "-m", "pytest", *words, *(f"tests/{one}" for one in tests)],
        cwd=tree,
        env={**os.environ, "PYTHONPATH": str(tree), "IVEG_HYPOTHESIS": "quick"},
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        check=False,
    ).returncode


def main() -> int:
    """Try them all and say which were caught; 1 where one was not."""
    tests = tuple(sorted({one for mutant in MUTANTS for one in mutant.tests}))
    if _status(ROOT, tests) != 0:
        print("The tests fail without any mistake.")
        return 1
    missed = 0
    for mutant in MUTANTS:
        caught = is_caught(mutant)
        missed += not caught
        print("caught" if caught else "MISSED", mutant.says)
    return min(missed, 1)


if __name__ == "__main__":
    sys.exit(main())
