"""Templates of the pages, in one language each, with the words that they may use."""

import json
from dataclasses import asdict
from datetime import datetime
from importlib.resources import files

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup, escape

from iveg.domain.limits import LIMITS
from iveg.domain.stamps import format_stamp
from iveg.web.pages.local_time import in_madrid
from iveg.web.pages.sentences import Sentences
from iveg.web.pages.translations import Slot, Translations


def limits_text() -> str:
    """The table of safety numbers, as ``static/js/core/limits.js`` reads it."""
    return json.dumps(asdict(LIMITS))


def _clock(stamp: str) -> str:
    """Time of day in Madrid of an ISO-8601 stamp."""
    return f"{in_madrid(datetime.fromisoformat(stamp).timestamp()):%H:%M:%S}"


def _wall(stamp: str) -> str:
    """Day and time in Madrid of an ISO-8601 stamp, as a form has them."""
    at = datetime.fromisoformat(stamp).timestamp()
    return in_madrid(at).isoformat(" ", "seconds")


def _before(stamp: str) -> str:
    """Ten seconds before an ISO-8601 stamp, as an address of the map of then."""
    at = datetime.fromisoformat(stamp).timestamp()
    return f"/?t={format_stamp(at - 10.0)}"


def environment_of(translations: Translations) -> Environment:
    """Templates that speak one language."""
    environment = Environment(
        loader=FileSystemLoader(str(files("iveg") / "templates")),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )

    environment.filters["clock"] = _clock
    environment.filters["wall"] = _wall
    environment.filters["before"] = _before
    environment.filters["lane"] = Sentences(translations).lane

    def say(key: str, **slots: Slot) -> Markup:
        data = Markup(' data-slots="{}"').format(json.dumps(slots)) if slots else ""
        return Markup('<span data-i18n="{}"{}>{}</span>').format(
            key, data, translations.say(key, **slots)
        )

    def label(attribute: str, key: str, **slots: Slot) -> Markup:
        data = Markup(' data-slots="{}"').format(json.dumps(slots)) if slots else ""
        return Markup('{}="{}" data-i18n-{}="{}"{}').format(
            attribute, translations.say(key, **slots), attribute, key, data
        )

    def greenhouse(name: str) -> str:
        return translations.sentences.get(f"greenhouse.{name}", name)

    def say_house(name: str) -> Markup:
        key = f"greenhouse.{name}"
        return say(key) if key in translations.sentences else escape(name)

    environment.globals.update(
        greenhouse=greenhouse,
        say_house=say_house,
        t=translations.say,
        say=say,
        label=label,
        has=translations.sentences.__contains__,
        limits=LIMITS,
        limits_text=limits_text(),
    )
    return environment
