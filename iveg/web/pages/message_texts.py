"""Messages to people elsewhere, in words."""

from collections.abc import Callable

from iveg.domain.messages import (
    Language,
    MessageText,
    OutboundMessage,
)
from iveg.web.pages.sentences import Sentences
from iveg.web.pages.translations import LANGUAGES, read_translations


def writer() -> Callable[[OutboundMessage, Language], MessageText]:
    """Writes messages in words: priority and time, but no place and no person."""
    sentences = {one: Sentences(read_translations(one)) for one in LANGUAGES}

    def write(message: OutboundMessage, language: Language) -> MessageText:
        said = sentences[language]
        if message.is_test:
            return MessageText(
                said.say("messages.test_title", {}), said.say("messages.test_body", {})
            )
        slots = {
            "priority": message.priority,
            "count": len(message.items),
            "at": min(one.raised.wall for one in message.items),
        }
        key = "one" if len(message.items) == 1 else "more"
        return MessageText(
            said.say("messages.title", slots), said.say(f"messages.body_{key}", slots)
        )

    return write
