"""What people change beside the loop, wired to what the last run left of it."""

import asyncio
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from iveg.domain.contacts import Contacts
from iveg.domain.detection_rule import DetectionRule
from iveg.domain.detector import OutOfService
from iveg.domain.messages import Channel
from iveg.domain.revocation import Revocation
from iveg.domain.rule.trial import Trial
from iveg.pipeline.coverage import CoverageMonitor
from iveg.pipeline.detectors import Detectors
from iveg.pipeline.mapping import Mapper
from iveg.pipeline.messenger import Messenger
from iveg.pipeline.parts import Pipeline
from iveg.pipeline.ports import (
    BrokerAccess,
    ChoiceStore,
    Clock,
    MessageSender,
    RuleStore,
)
from iveg.pipeline.revocations import Pause, Revocations
from iveg.pipeline.rules import Rules
from iveg.pipeline.things import ThingMarks
from iveg.pipeline.trials import Trials


@dataclass(frozen=True, slots=True)
class KeptChoices:
    """Choices that people made while iVeg ran, and their stores.

    Attributes:
        rules: Every version of the rule, oldest first.
        contacts: People outside whom iVeg sends messages.
        out_of_service: Detectors that nobody waits for, by robot.
        trial: Of a candidate of the rule.
    """

    rule_store: RuleStore
    contact_store: ChoiceStore[Contacts]
    detector_store: ChoiceStore[Mapping[str, OutOfService]]
    trial_store: ChoiceStore[Trial | None]
    revocation_store: ChoiceStore[Mapping[str, Revocation]]
    broker_access: BrokerAccess
    rules: Sequence[DetectionRule] = ()
    contacts: Contacts = field(default_factory=Contacts)
    out_of_service: Mapping[str, OutOfService] = field(default_factory=dict)
    trial: Trial | None = None
    revoked: Mapping[str, Revocation] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Services:
    """Parts beside the rule loop, for people; STOP and speed limits need none."""

    rules: Rules
    detectors: Detectors
    things: ThingMarks
    messenger: Messenger
    mapper: Mapper
    coverage: CoverageMonitor
    trials: Trials
    revocations: Revocations


def build_services(
    parts: Pipeline,
    kept: KeptChoices,
    senders: Mapping[Channel, MessageSender],
    clock: Clock,
    pause: Pause = asyncio.sleep,
) -> Services:
    """The parts beside a pipeline; raised alerts reach the messenger."""
    evaluator, event_log = parts.evaluator, parts.event_log
    greenhouse, alerts = evaluator.greenhouse, evaluator.alerts
    messenger = Messenger(
        kept.contacts, kept.contact_store, senders, alerts, event_log, clock
    )
    alerts.on_raised = parts.supervision.guard("messages", messenger.enqueue_raised)
    rules = Rules(evaluator, kept.rule_store, event_log, kept.rules)
    store = kept.trial_store
    return Services(
        rules,
        Detectors(parts.world, kept.detector_store, event_log, kept.out_of_service),
        ThingMarks(evaluator.people, event_log, evaluator.obstacles.shown),
        messenger,
        Mapper(parts.world, greenhouse.bounds, parts.scans),
        CoverageMonitor(parts.world, greenhouse),
        Trials(parts.shadow, evaluator, rules, store, kept.trial, clock),
        _revocations(parts, kept, clock, pause),
    )


def _revocations(
    parts: Pipeline, kept: KeptChoices, clock: Clock, pause: Pause
) -> Revocations:
    store, access, log = kept.revocation_store, kept.broker_access, parts.event_log
    world, commander = parts.world, parts.commander
    return Revocations(world, commander, store, access, log, clock, kept.revoked, pause)
