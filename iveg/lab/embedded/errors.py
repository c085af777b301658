"""What Orion and the IoT Agent refuse, and what the embedded ones do not support."""

import orjson

from iveg.domain.errors import IvegError

ENTITY_NOT_FOUND = "The requested entity has not been found. Check type and id"
ATTRIBUTE_NOT_FOUND = "The entity does not have such an attribute"
_STATUS = {
    # Orion
    "BadRequest": 400,
    "ParseError": 400,
    "NotFound": 404,
    "MethodNotAllowed": 405,
    "NotAcceptable": 406,
    "TooManyResults": 409,
    "ContentLengthRequired": 411,
    "RequestEntityTooLarge": 413,
    "UnsupportedMediaType": 415,
    "Unprocessable": 422,
    "PartialUpdate": 422,
    "NotImplemented": 501,
    # IoT Agent
    "WRONG_SYNTAX": 400,
    "MISSING_ATTRIBUTES": 400,
    "MISSING_CONFIG_PARAMS": 400,
    "MISSING_HEADERS": 400,
    "DEVICE_NOT_FOUND": 404,
    "DEVICE_GROUP_NOT_FOUND": 404,
    "DUPLICATE_DEVICE_ID": 409,
    "DUPLICATE_GROUP": 409,
    "SyntaxError": 500,
}


class FiwareError(IvegError):
    """A request that Orion or the IoT Agent would refuse.

    Attributes:
        status: HTTP status; that of the name unless given.
        name: Error name, such as ``BadRequest`` or ``DUPLICATE_DEVICE_ID``.
        sentence: The description or message.
    """

    def __init__(self, name: str, sentence: str, status: int = 0) -> None:
        self.status = status or _STATUS[name]
        self.name = name
        self.sentence = sentence
        super().__init__(f"{self.status} {name}: {sentence}")

    def body(self, name: str, sentence: str) -> bytes:
        """The JSON body of the response, with the keys of the service that answers."""
        return orjson.dumps({name: self.name, sentence: self.sentence})


def bad_request(sentence: str) -> FiwareError:
    """400, with Orion's sentence."""
    return FiwareError("BadRequest", sentence)


def parse_error() -> FiwareError:
    """400 for a body that is not JSON, or not an object."""
    return FiwareError("ParseError", "Errors found in incoming JSON buffer")


def not_found(sentence: str = ENTITY_NOT_FOUND) -> FiwareError:
    """404 of Orion, by default for an entity."""
    return FiwareError("NotFound", sentence)


def too_many() -> FiwareError:
    """409 for an id that matches several entities."""
    return FiwareError(
        "TooManyResults", "More than one matching entity. Please refine your query"
    )


def not_supported(what: str) -> FiwareError:
    """501 for a feature that the embedded FIWARE leaves out."""
    return FiwareError(
        "NotImplemented", f"{what} is not supported by the embedded FIWARE"
    )


def wrong_syntax() -> FiwareError:
    """400 of the agent for a body of another shape."""
    return FiwareError(
        "WRONG_SYNTAX", "Wrong syntax in request: Errors found validating request."
    )


def no_device(name: str) -> FiwareError:
    """404 of the agent for a device, or for an entity without one."""
    return FiwareError("DEVICE_NOT_FOUND", f"No device was found with id:{name}")
