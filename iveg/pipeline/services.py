"""What people change beside the loop, wired to what the last run left of it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from iveg.domain.detection_rule import DetectionRule
from iveg.domain.detector import OutOfService
from iveg.domain.rule.trial import Trial
from iveg.domain.words import WordAnswer
from iveg.pipeline.coverage import CoverageMonitor
from iveg.pipeline.detectors import Detectors
from iveg.pipeline.mapping import Mapper
from iveg.pipeline.parts import Pipeline
from iveg.pipeline.ports import (
    ChoiceStore,
    Clock,
    RuleStore,
)
from iveg.pipeline.rules import Rules
from iveg.pipeline.things import ThingMarks
from iveg.pipeline.trials import Trials


@dataclass(frozen=True, slots=True)
class KeptChoices:
    """Choices that people made while iVeg ran, and their stores.

    Attributes:
        rules: Every version of the rule, oldest first.
        out_of_service: Detectors that nobody waits for, by robot.
        words: What operators said of words of detectors.
        trial: Of a candidate of the rule.
    """

    rule_store: RuleStore
    detector_store: ChoiceStore[Mapping[str, OutOfService]]
    word_store: ChoiceStore[Mapping[str, WordAnswer]]
    trial_store: ChoiceStore[Trial | None]
    rules: Sequence[DetectionRule] = ()
    out_of_service: Mapping[str, OutOfService] = field(default_factory=dict)
    words: Mapping[str, WordAnswer] = field(default_factory=dict)
    trial: Trial | None = None


@dataclass(frozen=True, slots=True)
class Services:
    """Parts beside the rule loop, for people; STOP and speed limits need none."""

    rules: Rules
    detectors: Detectors
    things: ThingMarks
    mapper: Mapper
    coverage: CoverageMonitor
    trials: Trials


def build_services(
    parts: Pipeline,
    kept: KeptChoices,
    clock: Clock,
) -> Services:
    """The parts beside a pipeline."""
    evaluator, event_log = parts.evaluator, parts.event_log
    greenhouse = evaluator.greenhouse
    rules = Rules(evaluator, kept.rule_store, event_log, kept.rules)
    store = kept.trial_store
    return Services(
        rules,
        Detectors(
            parts.world,
            kept.detector_store,
            kept.word_store,
            event_log,
            kept.out_of_service,
            kept.words,
        ),
        ThingMarks(evaluator.people, event_log),
        Mapper(parts.world, greenhouse.bounds, parts.scans),
        CoverageMonitor(parts.world, greenhouse),
        Trials(parts.shadow, evaluator, rules, store, kept.trial, clock),
    )
