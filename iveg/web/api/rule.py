"""The detection rule over HTTP: the version in force, earlier ones, a new one."""

from typing import Annotated, Any

from fastapi import APIRouter, Response
from pydantic import Field, field_validator

from iveg.comfort.trials import Trials
from iveg.domain.detection_rule import DetectionRule
from iveg.domain.errors import VersionMissingError
from iveg.domain.parameters import PARAMETERS, Class
from iveg.domain.wire import clean_text
from iveg.models.base import Body, Listing, with_fields
from iveg.models.rule import Rule as RuleModel
from iveg.models.rule import Trial as TrialModel
from iveg.models.rule import parameter_fields
from iveg.vital.operators import Rules
from iveg.vital.ports import Clock
from iveg.web.api.answers import Json
from iveg.web.security.requirements import READERS, Operator

_MOST_ALIASES = 200


@with_fields(parameter_fields(lambda row: row.key, "none"))
class RuleChange(Body):
    """The parameters to change; others stay as they are.

    A detector's word must stand for `person` or `robot`; both names always stand for
    themselves.
    """

    version: int | None = None
    """The version that the person saw: 428 without, 409 when it is in force no more."""
    aliases: Annotated[dict[str, Class], Field(max_length=_MOST_ALIASES)] | None = None

    @field_validator("aliases")
    @classmethod
    def _readable(cls, aliases: dict[str, Class] | None) -> dict[str, Class] | None:
        if aliases is None:
            return None
        cleaned = {clean_text(name).strip().lower(): aliases[name] for name in aliases}
        # A word that is a class itself must not stand for the other class.
        class_words: dict[str, Class] = {"person": "person", "robot": "robot"}
        if "" in cleaned or any(cleaned.get(n, c) != c for n, c in class_words.items()):
            raise ValueError("names must not be empty; person and robot are themselves")
        return {**cleaned, **class_words}

    def applied_to(self, rule: DetectionRule) -> DetectionRule:
        """A rule with these parameters, which has no author yet."""
        named = dict(self)
        values: dict[str, Any] = {
            row.name: row.read(named, getattr(rule, row.name), row.key)
            for row in PARAMETERS
        }
        aliases = dict(rule.aliases) if self.aliases is None else self.aliases
        return DetectionRule(
            **values, id=rule.id, version=rule.version, aliases=aliases
        )


class Promotion(Body):
    """The version in force that the person saw beside the trial."""

    version: int


def router(rules: Rules, trials: Trials, clock: Clock) -> APIRouter:
    """Routes of rule and trial, read by all and changed by operators.

    Every version keeps its author and time; a trial acts on nothing.
    """
    routes = APIRouter(prefix="/api/v1", tags=["rule"])

    @routes.get("/rule", response_model=RuleModel, dependencies=READERS)
    async def rule() -> Response:
        """The version in force."""
        return Json(RuleModel.from_rule(rules.current))

    @routes.get(
        "/rule/versions", response_model=Listing[RuleModel], dependencies=READERS
    )
    async def versions() -> Response:
        """Every version with its author and time, newest first."""
        items = [RuleModel.from_rule(rule) for rule in reversed(rules.versions)]
        return Json(Listing(items=items))

    @routes.put("/rule", response_model=RuleModel)
    async def change(body: RuleChange, who: Operator) -> Response:
        """Put a new version in force at once; parameters without a value stay."""
        if body.version is None:
            raise VersionMissingError("The rule")
        # Two people who change it at once: the second is refused (409).
        candidate = body.applied_to(rules.current)
        changed = await rules.change(candidate, who.name, clock(), body.version)
        return Json(RuleModel.from_rule(changed))

    @routes.get(
        "/rule/trial",
        response_model=Listing[TrialModel],
        dependencies=READERS,
    )
    async def current() -> Response:
        """The trial, if one runs: it acts on nothing."""
        trial = trials.current
        return Json(Listing(items=[TrialModel.from_trial(trial)] if trial else []))

    @routes.post("/rule/trial", response_model=TrialModel, status_code=201)
    async def begin(body: RuleChange, who: Operator) -> Response:
        """Try the rule in force with other parameters, beside it."""
        candidate = body.applied_to(rules.current)
        return Json(
            TrialModel.from_trial(trials.begin(candidate, who.name, clock())), 201
        )

    @routes.delete("/rule/trial", response_model=TrialModel)
    async def end(_: Operator) -> Response:
        """End the trial; the answer is its account."""
        return Json(TrialModel.from_trial(trials.end()))

    @routes.post("/rule/trial/promote", response_model=RuleModel)
    async def promote(body: Promotion, who: Operator) -> Response:
        """Put the candidate in force, with the result of the trial."""
        return Json(
            RuleModel.from_rule(await trials.promote(who.name, clock(), body.version))
        )

    return routes
