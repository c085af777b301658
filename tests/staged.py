"""Situations as a day brings them, and what the status line must say of each."""

from dataclasses import replace
from typing import Any

from iveg.domain.events import Condition
from iveg.domain.feedback import CLEAR, SpeedLimit
from iveg.domain.observations import Hold
from iveg.domain.rule.clear import ClearCondition
from iveg.domain.situation import Near, RobotFacts, situation_of
from iveg.models.robot import Situation
from tests.builders import safety_report


def facts(**differs: Any) -> RobotFacts:
    """AGI at work, all clear; a test says what differs."""
    clear = safety_report("AGI", speed_factor=1.0, reason="clear")
    plain: dict[str, Any] = {
        "robot_id": "AGI",
        "link": "LIVE",
        "age_s": 0.1,
        "stands": False,
        "report": clear,
        "limit": CLEAR,
    }
    return RobotFacts(**{**plain, **differs})


def p1(key: str, **slots: Any) -> list[Condition]:
    return [Condition.of_robot("P1", key, "AGI", **slots)]


AISLE_3 = Near("person", "P1", 1.4, "Pasillo 3")
UNSEEN = replace(AISLE_3, unseen_s=4.1)
HALF = safety_report("AGI", speed_factor=0.5, reason="person")
TOLD = SpeedLimit(0.5, "person", "P1", 1.4)
LOCKED = safety_report("AGI", Hold("x", "hw", "local"))
AHEAD = replace(AISLE_3, distance_m=3.4, foretold_s=1.8)
WALL_OF_CRATES = Near("obstacle", None, 0.9)

STAGED = {
    "does not slow": (
        facts(alerts=p1("alert.person_not_slowing"), alert_about=AISLE_3),
        "danger",
        ("no frena", "persona en el pasillo 3", "pulse PARAR"),
        ("does not slow down", "person in aisle 3", "press STOP"),
    ),
    "lost while moving": (
        facts(link="LOST", age_s=4.0, alerts=p1("alert.moving_robot_lost")),
        "danger",
        ("sin contacto desde hace 4 s", "use la seta roja"),
        ("no contact for 4 s while moving", "use the red button"),
    ),
    "STOP not confirmed": (
        facts(alerts=p1("alert.stop_unconfirmed"), stop="UNCONFIRMED"),
        "danger",
        ("parada sin confirmar", "use la seta roja"),
        ("STOP not confirmed", "use the red button"),
    ),
    "STOP not obeyed": (
        facts(alerts=p1("alert.stop_still_moving"), stop="STILL_MOVING"),
        "danger",
        ("parada recibida pero se mueve", "use la seta roja"),
        ("STOP received but still moving", "use the red button"),
    ),
    "another iVeg": (
        facts(alerts=p1("alert.another_iveg", boot="b2"), near=AISLE_3, report=HALF),
        "danger",
        ("otro iVeg habla a los robots", "apague uno"),
        ("another iVeg speaks to the robots", "stop one of them"),
    ),
    "half speed": (
        facts(report=HALF, near=AISLE_3, limit=TOLD, limit_near=AISLE_3),
        "caution",
        ("a media velocidad", "persona en el pasillo 3 a 1,4 m"),
        ("at half speed", "person in aisle 3 at 1.4 m"),
    ),
    "half speed for a memory": (
        facts(report=HALF, near=UNSEEN, limit=TOLD, limit_near=UNSEEN),
        "caution",
        ("a media velocidad", "hubo una persona en el pasillo 3", "hace 4 s"),
        ("at half speed", "a person was in aisle 3", "4 s ago"),
    ),
    "a zone ahead": (
        facts(report=HALF, near=AHEAD, limit=TOLD, limit_near=AHEAD),
        "caution",
        ("a media velocidad", "persona a 3,4 m, su zona en 1,8 s"),
        ("at half speed", "person at 3.4 m, its zone in 1.8 s"),
    ),
    "something that only a laser sees": (
        facts(
            report=safety_report("AGI", speed_factor=0.5, reason="obstacle"),
            near=WALL_OF_CRATES,
        ),
        "caution",
        ("a media velocidad", "alguien o algo a 0,9 m (láser)"),
        ("at half speed", "somebody or something at 0.9 m (laser)"),
    ),
    "stands for what a laser sees": (
        facts(
            report=safety_report("AGI", speed_factor=0.0, reason="obstacle"),
            near=WALL_OF_CRATES,
            stands=True,
        ),
        "caution",
        ("se ha parado por sí mismo", "alguien o algo a 0,9 m (láser)"),
        ("stands by itself", "somebody or something at 0.9 m (laser)"),
    ),
    "nobody supervises": (
        facts(report=safety_report("AGI", speed_factor=0.5, reason="unsupervised")),
        "doubt",
        ("a media velocidad", "nadie lo supervisa"),
        ("at half speed", "nobody supervises it"),
    ),
    "hears no server": (
        facts(report=safety_report("AGI", speed_factor=0.5, reason="watchdog")),
        "doubt",
        ("a media velocidad", "no le llega nada del servidor", "mire la batería"),
        ("at half speed", "hears nothing from the server", "check battery"),
    ),
    "a camera is out": (
        facts(out_of_service_by="Ana"),
        "doubt",
        ("sin cámara: fuera de servicio, por Ana", "revise esa cámara"),
        (
            "without a camera: taken out of service by Ana",
            "check that camera",
        ),
    ),
    "a camera is out near somebody": (
        facts(out_of_service_by="Ana", near=AISLE_3, report=HALF),
        "caution",
        ("sin cámara: persona en el pasillo 3 a 1,4 m",),
        ("without a camera: person in aisle 3 at 1.4 m",),
    ),
    "a camera is blind": (
        facts(alerts=p1("alert.camera_blind", by="AGII")),
        "doubt",
        ("su cámara no muestra a nadie donde AGII ve a alguien", "revise esa cámara"),
        ("its camera shows nobody where AGII sees somebody", "check that camera"),
    ),
    "faster than half": (
        facts(report=HALF, near=AISLE_3, is_slow=False),
        "caution",
        ("se le pide ir al 50", "persona en el pasillo 3 a 1,4 m"),
        ("told to drive at 50%", "person in aisle 3 at 1.4 m"),
    ),
    "a camera is silent": (
        facts(
            report=safety_report("AGI", speed_factor=0.5, reason="stale"),
            unmet=(ClearCondition("detector", "AGII"),),
        ),
        "doubt",
        ("a media velocidad", "no se lee la cámara de AGII", "revise esa cámara"),
        ("at half speed", "the camera of AGII is not being read", "check that camera"),
    ),
    "stopping": (
        facts(stop="SENT"),
        "caution",
        ("parada enviada", "trátelo como en marcha"),
        ("STOP sent, not confirmed yet", "treat it as moving"),
    ),
    "late": (
        facts(link="LATE", age_s=1.8),
        "doubt",
        ("última noticia hace\xa01,8\xa0s", "trátelo como en marcha"),
        ("last news 1.8\xa0s ago", "treat it as moving"),
    ),
    "contradicts itself": (
        facts(doubts=("jumped",)),
        "doubt",
        ("salta de un lugar a otro", "revise el robot"),
        ("jumps from place to place", "check the robot"),
    ),
    "red button": (
        facts(report=LOCKED, stands=True),
        "locked",
        ("bloqueado: seta roja del robot", "desbloquéelo en el robot"),
        ("locked: red button on the robot", "unlock it at the robot"),
    ),
    "stopped from a page": (
        facts(stop="STANDING", stands=True, report=LOCKED),
        "locked",
        ("bloqueado por la parada", "rearme con la vía libre"),
        ("locked by STOP", "release it once it is clear"),
    ),
    "a low battery": (
        facts(alerts=p1("alert.battery_low", level=0.18)),
        "working",
        ("batería al 18", "llévelo a cargar"),
        ("battery at 18%", "take it to charge"),
    ),
    "all clear": (
        facts(),
        "working",
        ("en marcha, vía libre",),
        ("at work, all clear",),
    ),
}
"""Facts, level, and what the status line says besides the robot's name."""


def told(known: RobotFacts) -> dict[str, Any]:
    """The situation as a page hears it."""
    return Situation.from_value(situation_of(known)).model_dump(mode="json")
