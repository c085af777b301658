"""What an experiment found, in sentences: the first thing of its report."""

from collections.abc import Iterator, Mapping

from iveg.domain.records import Json
from iveg.lab.experiment.cells import ms, percent
from iveg.lab.experiment.paper_tables import COMPLETION, P95_BELOW_MS, PRINTED
from iveg.lab.experiment.tables import worst_p95

Result = Json


def conclusions(result: Result) -> Iterator[str]:
    """One sentence or two on each question, in English; what was not tried is left out.

    A number stands beside the paper's where the paper has one.
    """
    if result["protected"] is not None:
        yield _protection(result["protected"])
    if result["completion"]["runs"]:
        yield _completion(result)
        yield _slow_downs(result["slowdowns"])
    if (farmer := result["detection"]["farmer"])["recall"] is not None:
        yield from _detection(farmer)
    yield from _latency(result)
    yield from _stops(result["stack"]["stops"])


def _protection(protected: Json) -> str:
    met, never = protected["encounters"], protected["never_slowed"]
    if not met:
        return "Nobody in a camera's view came within 2 m of a moving robot."
    shares = [percent(protected["slowed"][one]) for one in ("in_view", "all")]
    return (
        f"With a person in some camera's view within 2 m, robots drove at no more than "
        f"half speed for {shares[0]} of the time ({shares[1]} with everybody within "
        f"2 m); in {never} of {met} encounters never. Virtual clock, rule as it stands."
    )


def _completion(result: Result) -> str:
    done, field = result["completion"], result["field"]
    paper = f"{COMPLETION['simulation']:.0%} in simulation, {COMPLETION['field']:.0%}"
    return (
        f"{done['completed']} of {done['runs']} runs were completed, and "
        f"{field['completed']} of {field['runs']} field tests with failures; "
        f"the paper: {paper} in the field."
    )


def _slow_downs(slowed: Mapping[str, int]) -> str:
    decided, applied, observed, unseen = (
        slowed.get(one, 0) for one in ("decided", "applied", "observed", "out_of_sight")
    )
    return (
        f"iVeg decided {decided} slow-downs: {applied} were applied by the robot's own "
        f"report, {observed} were seen in its speed, and {unseen} were for somebody "
        f"whom the robot could not see."
    )


def _detection(farmer: Json) -> Iterator[str]:
    if farmer["precision"] is None:
        return
    recall, precision = (
        percent(farmer[one]["share"]) for one in ("recall", "precision")
    )
    simulation, field = (PRINTED[place]["farmer"] for place in ("simulation", "field"))
    yield (
        f"The emulated detector told of {recall} of the farmers in view, and "
        f"{precision} of what it called a farmer was one. The paper: "
        f"{simulation.recall}% and "
        f"{simulation.precision}% in simulation, {field.recall}% and "
        f"{field.precision}% in the field."
    )


def _latency(result: Result) -> Iterator[str]:
    if (worst := worst_p95(result)) is None:
        return
    below = [f"below {P95_BELOW_MS[place]:.0f} ms" for place in ("simulation", "field")]
    yield (
        f"From robot to Orion, 95% of the messages of each kind took no longer than "
        f"{ms(worst)} ms; the paper: {below[0]} in simulation, {below[1]} in the field."
    )
    if result["configuration"].get("fiware") == "embedded":
        yield "All programs ran on one machine: no time is that of a radio link."


def _stops(stops: list[Json]) -> Iterator[str]:
    answers = [one["answer"]["direct"]["p50_ms"] for one in stops]
    stood = [one["standing"]["p50_ms"] for one in stops]
    if not stops or None in (*answers, *stood):
        return
    yield (
        f"After STOP ALL each robot answered within {ms(max(answers))} ms and stood "
        f"still within {ms(max(stood))} ms of the press (medians of each robot)."
    )
