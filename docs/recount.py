# ruff: noqa: D102, D103, B905, T201 - a script of its own, for readers
"""Recount the tables of an experiment's report from its raw data alone.

    python docs/recount.py experiments/full-001

It needs Python's standard library and nothing of iVeg's; docs/experiment.md has the
columns ("Raw data") and the definitions.  Each line is a row of the report that says
"here", its cells apart by tabs.
"""

import json
import math
import sys
from collections import Counter, defaultdict
from itertools import groupby
from pathlib import Path
from statistics import quantiles

CLASSES = ("farmer", "AGI", "AGII")
DATA = ("odometry", "detections", "lidar")
HALVES, READ = ("virtual", "real"), ("skipped", "passed")
SIZE_M, LOOK_S, SAME_PICTURE_S = {"farmer": 0.5}, 2.0, 0.06


def rows(file):
    return [json.loads(line) for line in file.read_text("utf-8").splitlines()]


def mean(values):
    return math.fsum(values) / len(values)


# --- detections -----------------------------------------------------------------------


def in_robot(picture, target):
    """The target's centre in the frame of the robot that has it in view (m)."""
    pose = picture["pose"]
    dx, dy = target["x"] - pose["x"], target["y"] - pose["y"]
    c, s = math.cos(pose["yaw"]), math.sin(pose["yaw"])
    return c * dx + s * dy, c * dy - s * dx


def overlap(class_id, one, other):
    """Intersection over union of two squares of a target's size."""
    size = SIZE_M.get(class_id, 1.0)
    shared = math.prod(max(0.0, size - abs(a - b)) for a, b in zip(one, other))
    return shared / (2 * size * size - shared)


def matches(picture, told):
    """Each target's detection, the surest first, and detections of nothing."""
    found, ghosts = {}, []
    for one in sorted(told["seen"], key=lambda each: -each["confidence"]):
        places = {
            target["key"]: overlap(
                one["class_id"], in_robot(picture, target), one["local"]
            )
            for target in picture["visible"]
            if target["class"] == one["class_id"] and target["key"] not in found
        }
        best = max(places, key=places.get, default=None)
        if best is None or places[best] < 0.5:
            ghosts.append(one)
        else:
            found[best] = one
    return found, ghosts


def pairs(half):
    """True and told pictures of one moment."""
    truth = defaultdict(list)
    for picture in rows(half / "truth.ndjson"):
        truth[picture["robot"]].append(picture)
    for told in rows(half / "told.ndjson"):
        near = truth[told["robot_id"]]
        best = min(near, key=lambda one: abs(one["at"] - told["at"]), default=None)
        if best is not None and abs(best["at"] - told["at"]) <= SAME_PICTURE_S:
            yield best, told


class Count:
    """One class; looks are two seconds of one robot at one target, in one run."""

    def __init__(self):
        self.found, self.ghosts, self.missed = [], [], 0
        self.looks, self.claims = set(), set()
        self.off_map, self.off_robot = [], []

    def find(self, picture, target, one):
        self.found.append(round(one["confidence"], 4))
        off = math.hypot(one["x"] - target["x"], one["y"] - target["y"])
        x, y = in_robot(picture, target)
        self.off_map.append(round(off, 4))
        self.off_robot.append(
            round(math.hypot(one["local"][0] - x, one["local"][1] - y), 4)
        )


def count(halves):
    """Counts by class, and how many pictures each run had."""
    counts, pictures = {name: Count() for name in CLASSES}, []
    for run, half in enumerate(halves):
        compared = list(pairs(half))
        pictures.append(len(compared))
        for picture, told in compared:
            look = run, picture["robot"], int(picture["at"] // LOOK_S)
            found, ghosts = matches(picture, told)
            for target in picture["visible"]:
                one = counts[target["class"]]
                one.looks.add((target["key"], *look))
                if target["key"] in found:
                    one.find(picture, target, found[target["key"]])
                    one.claims.add((target["key"], *look))
                else:
                    one.missed += 1
            for ghost in ghosts:
                one = counts[ghost["class_id"]]
                one.ghosts.append(round(ghost["confidence"], 4))
                one.claims.add(("", *look))
    return counts, pictures


def wilson(hits, of, worth):
    """A share (%) with its 95 % interval, where the counts are worth fewer."""
    if not of or not worth:
        return "–", None
    z, n, share = 1.959964, worth, hits / of
    middle = (share + z * z / (2 * n)) / (1 + z * z / n)
    root = math.sqrt(share * (1 - share) / n + z * z / (4 * n * n))
    half = z / (1 + z * z / n) * root
    low, high = max(0.0, middle - half), min(1.0, middle + half)
    return f"{100 * share:.1f} % [{100 * low:.1f}, {100 * high:.1f}]", share


def average_precision(found, ghosts, targets):
    """Area under the precision envelope over recall, all points."""
    if not targets:
        return None
    ranked = sorted([(-one, 1) for one in found] + [(-one, 0) for one in ghosts])
    hits, precisions = 0, []
    for rank, (_, hit) in enumerate(ranked, 1):
        hits += hit
        precisions.append((hits / rank, hit))
    area = best = 0.0
    for precision, hit in reversed(precisions):
        best = max(best, precision)
        area += best * hit / targets
    return area


def rates(counts):
    """Cells of some classes together, and precision, recall and AP as numbers."""
    found = [sure for one in counts for sure in one.found]
    ghosts = [sure for one in counts for sure in one.ghosts]
    missed = sum(one.missed for one in counts)
    tp, fp = len(found), len(ghosts)
    claims = sum(len(one.claims) for one in counts)
    looks = sum(len(one.looks) for one in counts)
    (shown_p, precision), (shown_r, recall) = (
        wilson(tp, tp + fp, claims),
        wilson(tp, tp + missed, looks),
    )
    ap = average_precision(found, ghosts, tp + missed)
    cells = (tp, fp, missed, shown_p, shown_r, "–" if ap is None else f"{ap:.2f}")
    return cells, (precision, recall, ap)


def detection(here, real):
    numbers = []
    for name in CLASSES:
        cells, told = rates([here[name]])
        numbers.append(told)
        yield name, "here", *cells
        yield name, "here, real time", *rates([real[name]])[0]
    yield "total", "here", *rates(here.values())[0]
    yield "total", "here, real time", *rates(real.values())[0]
    means = ([n for n in column if n is not None] for column in zip(*numbers))
    p, r, ap = (mean(column) if column else None for column in means)
    shown = ("–" if one is None else f"{100 * one:.1f} %" for one in (p, r))
    yield "mean", "here", "", "", "", *shown, "–" if ap is None else f"{ap:.2f}"


def claims(runs, fields, halves, here, took):
    """Numbers of the paper's text: completion, confidence, delivery, worst P95."""
    done = [sum(run["completed"][half] for run in runs) for half in HALVES]
    of = len(runs)
    yield f"{done[0]} of {of}; through all programs {done[1]} of {of}"
    completed = sum(run["completed"]["virtual"] for run in fields)
    yield f"{completed} of {len(fields)}"
    found = [sure for one in here.values() for sure in one.found]
    threshold = runs[0]["configuration"]["confidence_threshold"]
    yield f"{mean(found):.0%}" if found else "–"
    sure = sum(one >= threshold for one in found)
    yield f"{sure / len(found):.0%} ({threshold})" if found else "–"
    told = [rows(half / "messages.ndjson") for half in halves]
    lost = sum(one["orion"] is None for run in told for one in run)
    yield f"{lost} of {sum(map(len, told))}"
    yield sum(map(reordered, told))
    read = [sum(run["read"].get(name, 0) for run in runs) for name in READ]
    yield f"{read[0]} of {read[1]}"
    worst = max(float(row[10].replace("–", "0")) for row in took)
    yield f"{worst:.1f} ms" if worst else "–"


def place(here, real):
    for source, counts in (("here", here), ("here, real time", real)):
        for name in CLASSES:
            cells = []
            for off in (counts[name].off_map, counts[name].off_robot):
                if off:
                    worst = sorted(off)[math.ceil(0.95 * len(off)) - 1]
                    cells += [f"{mean(off):.3f}", f"{worst:.3f}"]
                else:
                    cells += ["–", "–"]
            yield name, source, len(counts[name].found), *cells


# --- decisions and costmaps -----------------------------------------------------------


def sight(halves):
    """Slow-downs, and people out of AGII's sight that were reported to it."""
    found = Counter()
    for half in halves:
        for one in rows(half / "decisions.ndjson"):
            if one["reason"] in ("person", "robot"):
                found["decided"] += 1
                found["applied"] += one["applied_at"] is not None
                found["observed"] += one["observed_at"] is not None
                found["out of sight"] += one["in_sight"] is False
        asked = rows(half / "costmap.ndjson")
        first = [one for one in asked if one["first"]]
        found["asked"] += sum(one["held"] != "own" for one in asked)
        found["injected"] += sum(one["held"] == "told" for one in asked)
        found["people"] += len({one["key"] for one in first})
        found["ahead"] += len({one["key"] for one in first if one["held"] == "told"})
    names = ("decided", "applied", "observed", "out of sight")
    return [found[name] for name in (*names, "asked", "injected", "people", "ahead")]


# --- protection -----------------------------------------------------------------------

NEAR_M, FAR_M, MOVES_M_S, PAUSE_S = 2.0, (2.3, 4.0), 0.05, 1.0
STILL_S, KNOWN_S, AHEAD_S, SLOW = 0.25, 2.0, 1.5, 0.55
SIGHTS = ("in view", "behind plants", "unseen")
ENTERED = ("in view for 2 s", "stepped into view later", "in no camera's view")


def at(row):
    return row["at"]


def distance(one, other):
    return math.dist((one["x"], one["y"]), (other["x"], other["y"]))


def told_of(half):
    """Who iVeg says a robot will meet: function of a row of the truth."""
    told = {(one["robot"], one["at"]): one for one in rows(half / "encounters.ndjson")}

    def whom(row):
        for place in told.get((row["robot"], row["at"]), {"people": ()})["people"]:
            nearest = min(row["people"], key=lambda one: distance(one, place))
            if distance(nearest, place) <= 1.0:
                yield nearest["key"]

    return whom


def moments(half, measured):
    """Each row of the truth, how long it counts, and whom some camera has in view."""
    truth, newest = rows(half / "truth.ndjson"), {}
    if measured is not None:
        began, ended = measured["began"], measured["ended"]
        truth = [one for one in truth if began <= one["at"] <= ended]
    for now, group in groupby(sorted(truth, key=at), at):
        same, last = list(group), dict(newest)
        newest.update({row["robot"]: row for row in same})
        young = [row for row in newest.values() if now - row["at"] <= STILL_S]
        seen = {one["key"] for row in young for one in row["visible"]}
        for row in same:
            yield row, min(now - last.get(row["robot"], row)["at"], STILL_S), seen


class Guarded:
    """Protection in some runs together."""

    def __init__(self):
        self.near, self.slowed, self.needless = Counter(), Counter(), Counter()
        self.driven_s = self.driven_m = 0.0
        self.delays, self.entries = [], []

    def add(self, half, measured):
        """One run: pairs of a robot and a person, moment by moment."""
        whom, pairs, met = told_of(half), defaultdict(dict), []
        for row, lasts, seen in moments(half, measured):
            told, slowed = set(whom(row)), row["factor"] <= 0.5
            moves = abs(row["speed"]) >= MOVES_M_S
            away = {one["key"]: distance(row["pose"], one) for one in row["people"]}
            for one in row["people"]:
                key = one["key"]
                pair, near = pairs[row["robot"], key], away[key] <= NEAR_M
                self.enter(row, pair, near, key in seen, key in told)
                if near and moves:
                    hidden = "behind plants" if one["hidden"] else "unseen"
                    sight = "in view" if key in seen else hidden
                    self.near[sight] += lasts
                    self.slowed[sight] += lasts * slowed
                    if key in seen:
                        meet(row["at"], pair, met, slowed)
            self.driven_s += lasts * moves
            self.driven_m += abs(row["speed"]) * lasts * moves
            for far in FAR_M:
                if moves and slowed and min(away.values(), default=math.inf) > far:
                    self.needless[far] += lasts
        self.delays += [one.get("delay") for one in met]

    def enter(self, row, pair, near, is_seen, is_told):
        """Note a ring that is entered, and what was known of the person."""
        now = row["at"]
        pair["seen"] = pair.get("seen", now) if is_seen else None
        if pair["seen"] is None:
            del pair["seen"]
        if pair.get("outside") and near and row["wanted"] > MOVES_M_S:
            ahead = 0.0
            if now - pair.get("told at", -math.inf) <= PAUSE_S:
                ahead = round(now - pair["told"], 3)
            seen_s = now - pair.get("seen", math.inf)
            known = (seen_s < KNOWN_S - 1e-6) if is_seen else 2
            share = round(abs(row["speed"]) / row["wanted"], 4)
            self.entries.append((ENTERED[known], ahead, share))
        pair["outside"] = not near
        if is_told:
            if now - pair.get("told at", -math.inf) > PAUSE_S:
                pair["told"] = now
            pair["told at"] = now

    def rows(self, where, foresees):
        """Its row of the first table, and its rows of the second."""
        cells = []
        for sight in SIGHTS:
            share = of(self.slowed[sight], self.near[sight])
            cells += [f"{round(self.near[sight], 2):.1f}", share]
        delays = [one for one in self.delays if one is not None]
        cells += [len(self.delays), self.delays.count(None), *spread_of(delays)]
        cells += [of(self.needless[far], self.driven_s) for far in FAR_M]
        first = ("protection", *where, *cells, f"{round(self.driven_m, 1):.1f}")
        entries = []
        for known in ENTERED:
            own = [one for one in self.entries if one[0] == known]
            ahead = of(sum(told >= AHEAD_S - 1e-6 for _, told, _ in own), len(own))
            slow = of(sum(share <= SLOW for _, _, share in own), len(own))
            told = ahead if foresees else "–"
            entries.append(("entries", *where, known, len(own), told, slow))
        return first, entries


def meet(now, pair, met, slowed):
    """An encounter goes on, or begins after a pause."""
    if now - pair.get("met at", -math.inf) > PAUSE_S:
        pair["met"] = {"began": now}
        met.append(pair["met"])
    pair["met at"] = now
    if slowed:
        pair["met"].setdefault("delay", round(now - pair["met"]["began"], 3))


def of(part, whole):
    return "–" if whole == 0.0 else f"{round(part / whole, 4):.1%}"


def spread_of(delays):
    """Median and 95th percentile (s)."""
    if len(delays) < 2:
        return [f"{delays[0]:.2f}" if delays else "–"] * 2
    parts = quantiles(delays, n=100, method="inclusive")
    return [f"{round(parts[n - 1], 3):.2f}" for n in (50, 95)]


def protection(places):
    """Rows of both tables: scenarios, their real half, then each profile and rule."""
    groups = defaultdict(Guarded)
    for place_of, run in sorted(
        places, key=lambda one: "real" not in one[1]["completed"]
    ):
        chosen = run["profile"], run["rule"]
        timed = "real" in run["completed"]
        where = "scenarios" if timed else run["family"]
        groups[where, *chosen].add(place_of / "virtual", None)
        if timed:
            groups["real time", *chosen].add(place_of / "real", run["measured"])
    told = [one.rows(where, where[0] != "real time") for where, one in groups.items()]
    yield from (first for first, _ in told)
    yield from (row for _, entries in told for row in entries)


# --- messages -------------------------------------------------------------------------

_GAMMA = 1.01 / 0.99


def cells_of(durations_ms):
    """n, mean and P95; the P95 from bins that are 2 % wide, as on the page Latency."""
    bins = Counter(
        math.ceil(math.log(max(one, 1e-3) / 1000) / math.log(_GAMMA))
        for one in durations_ms
    )
    return spread(bins, math.fsum(durations_ms))


def spread(bins, total_ms):
    n = sum(bins.values())
    if not n:
        return 0, "–", "–"
    passed = 0
    for key in sorted(bins):
        passed += bins[key]
        if passed > 0.95 * (n - 1):
            break
    p95 = 1000 * _GAMMA**key * 2 / (1 + _GAMMA)
    return n, f"{round(total_ms / n, 2):.1f}", f"{round(p95, 2):.1f}"


def times(message):
    """Δt₁ and Δt₂ (ms); None where Orion's copy was first or never came."""
    stamp, broker, orion = message["stamp"], message["broker"], message["orion"]
    if stamp is None or orion is None or orion < broker:
        return None
    if not -0.001 <= broker - stamp <= 60.0:
        return None
    return 1000 * max(0.0, broker - stamp), 1000 * (orion - broker)


def latency(halves):
    messages = [m for half in halves for m in rows(half / "messages.ndjson")]
    decided = [h for half in halves for h in rows(half / "hops.ndjson")]
    for data in DATA:
        own = [one for one in messages if one["data"] == data]
        took = [both for both in map(times, own) if both is not None]
        came = [one for one in own if one["orion"] is not None]
        first = sum(one["orion"] < one["broker"] for one in came)
        share = f"{100 * first / len(came):.1f}%" if came else "–"
        bins, total = Counter(), 0.0
        for one in (one for one in decided if one["data"] == data):
            total += one["total_ms"]
            for edge, n in zip(one["edges_ms"], one["counts"]):
                bins[round(math.log(edge / 1000) / math.log(_GAMMA))] += n
        yield (
            *(data, "here"),
            *cells_of([up for up, _ in took]),
            *cells_of([on for _, on in took]),
            *cells_of([up + on for up, on in took]),
            *(share, *spread(bins, total)),
        )


def reordered(messages):
    """Messages that came out of Orion after a later one of their robot and kind."""
    newest, late = {}, 0
    came = [one for one in messages if one["orion"] is not None]
    for one in sorted(came, key=lambda each: each["orion"]):
        stream = one["robot_id"], one["data"], one["boot"]
        late += one["seq"] < newest.get(stream, one["seq"])
        newest[stream] = max(one["seq"], newest.get(stream, one["seq"]))
    return late


# --------------------------------------------------------------------------------------


def yes(one):
    return "yes" if one else "no"


def tables(directory):
    """Name and rows of each table."""
    places = {}
    for place_of in (directory / "raw").iterdir():
        run = json.loads((place_of / "run.json").read_text("utf-8"))
        places[run["number"], run["seed"], run["profile"], run["rule"]] = place_of, run
    every = [places[key] for key in sorted(places)]
    places = [one for one in every if "real" in one[1]["completed"]]
    runs = [run for _, run in places]
    halves = [[of / half for of, _ in places] for half in HALVES]
    (here, seen), (through, seen_through) = map(count, halves)
    took = list(latency(halves[1]))
    yield "detection", detection(here, through)
    yield "place", place(here, through)
    fields = [run for _, run in every if run["fails"]]
    yield "claims", ((one,) for one in claims(runs, fields, halves[1], here, took))
    yield "sight", zip(*map(sight, halves))
    yield "", protection(every)
    yield "latency", took
    yield (
        "stops",
        (
            (stop["robot_id"], ms(stop["answer"]["direct"]), ms(stop["standing"]))
            for run in runs
            for stop in run["stops"]
        ),
    )
    yield (
        "runs",
        (
            (
                *(run["number"], run["family"], run["seed"]),
                *(seen[n], yes(run["completed"]["virtual"])),
                *(seen_through[n], yes(run["completed"]["real"])),
                *(yes(run["settled"]), *run["load"]),
            )
            for n, run in enumerate(runs)
        ),
    )
    yield (
        "field",
        (
            (
                *(run["number"], run["profile"], run["seed"]),
                *(yes(run["completed"]["virtual"]), ", ".join(run["failures"]) or "–"),
            )
            for run in fields
        ),
    )


def ms(spread_of):
    return "–" if spread_of["p50_ms"] is None else f"{spread_of['p50_ms']:.1f}"


if __name__ == "__main__":
    for name, lines in tables(Path(sys.argv[1])):
        for line in lines:
            print(*(name,) if name else (), *line, sep="\t")
