"""The gap between a robot and a person, less what stopping takes (ISO 13855)."""

from pydantic import Field

from iveg.domain import margins
from iveg.domain.limits import LIMITS
from iveg.models.base import Model


class MarginParts(Model):
    """Terms of the protective distance (m)."""

    person_walks_m: float
    reaction_m: float
    braking_m: float
    uncertainty_m: float


class Margin(Model):
    """The gap to a person less what stopping takes; shown, never acted on."""

    robot_id: str
    person_id: str
    gap_m: float = Field(description="Between surfaces.")
    needs_m: float
    margin_m: float
    band: margins.Band
    parts: MarginParts
    age_s: float = Field(description="Age of the older position.")
    braking: float = Field(description="Counted on (m/s²).")
    walking_speed: float = Field(description="Counted on (m/s).")

    @classmethod
    def of(cls, margin: margins.SafetyMargin | None) -> "Margin | None":
        """Margin between a robot and a person; None where there is no pair."""
        if margin is None:
            return None
        return cls(
            robot_id=margin.robot_id,
            person_id=margin.person_id,
            gap_m=round(margin.gap_m, 2),
            needs_m=round(margin.needs_m, 2),
            margin_m=round(margin.margin_m, 2),
            band=margin.band,
            parts=MarginParts(
                person_walks_m=round(margin.walks_m, 2),
                reaction_m=round(margin.reaction_m, 2),
                braking_m=round(margin.braking_m, 2),
                uncertainty_m=LIMITS.uncertainty_m,
            ),
            age_s=round(margin.age_s, 3),
            braking=margin.braking,
            walking_speed=LIMITS.walking_m_s,
        )
