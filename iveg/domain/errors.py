"""Error tree; ``web/problems`` turns it into HTTP and adds the errors of HTTP alone.

IvegError
├── SettingsError           a setting that cannot be used; stops the start
├── DataFileError           a greenhouse, scenario or log file that cannot be used
├── MissingExtraError       a library that was not installed; stops the command
├── UnreadableError         bytes that the contract does not describe (HTTP 400)
├── NotAllowedError         a caller without the role (HTTP 403)
├── UnknownRobotError       a robot id that is not in the fleet (HTTP 404)
├── UnknownNameError        an unknown id of anything else (HTTP 404)
├── NotRecordedError        a moment without a recording (HTTP 404)
├── RefusedError            an act that must not happen now (HTTP 409)
│   ├── CommandRefusedError     a release, resume or goal
│   ├── MarkRefusedError        a mark "not a person here"
│   └── TrialRefusedError       beginning, ending or promoting the trial of a rule
├── OutdatedError           a change of an older version (HTTP 409)
├── ProvidedAccountError    a change that only the identity provider may make (HTTP 409)
├── NameTakenError          a name that another account has (HTTP 409)
├── NotANameError           a name that no account may have
├── VersionMissingError     a change that names no version (HTTP 428)
├── BusyError               more sign-ins wait than are served soon (HTTP 429)
├── SignOnError             a failed sign-in at the identity provider
├── VitalPartError          a part that STOP needs has ended; ends the process
└── HopError                a neighbour that cannot be reached or answered wrongly
    └── NoAnswerError       a neighbour that accepted a request and did not answer
"""


class IvegError(Exception):
    """Root of all errors that iVeg raises on purpose."""


class SettingsError(IvegError):
    """A setting has a value that iVeg cannot use."""

    def __init__(self, name: str, value: str, allowed: str) -> None:
        super().__init__(f"{name}={value!r} cannot be used: it must be {allowed}.")


class DataFileError(IvegError):
    """A data file cannot be used; names the file, the place in it and the reason."""

    def __init__(self, file: str, where: str, reason: str) -> None:
        place = f"{file}, {where}" if where else file
        super().__init__(f"{place}: {reason}")


class MissingExtraError(IvegError):
    """A command needs a library that belongs to an extra of the package."""

    def __init__(self, what: str, library: str, extra: str) -> None:
        super().__init__(
            f"{what} needs {library}, which is not installed: "
            f"pip install 'iveg[{extra}]'."
        )


class UnreadableError(IvegError):
    """A message or file is not as the contract describes it.

    Attributes:
        reason: Short, stable code for counters, such as ``not_json``.
        detail: Cause in words; may be empty.
    """

    def __init__(self, reason: str, detail: str = "") -> None:
        super().__init__(f"{reason}: {detail}" if detail else reason)
        self.reason = reason
        self.detail = detail


class NotRecordedError(IvegError):
    """Nothing was recorded at a moment.

    Attributes:
        at: The moment (Unix s).
        before: Newest recorded moment before it (Unix s); None: there is none.
        after: Oldest recorded moment after it (Unix s); None: there is none.
    """

    def __init__(self, at: float, before: float | None, after: float | None) -> None:
        super().__init__("Nothing was recorded at that moment.")
        self.at, self.before, self.after = at, before, after


class UnknownRobotError(IvegError):
    """No robot of the fleet has this id."""

    def __init__(self, robot_id: str) -> None:
        super().__init__(f"There is no robot {robot_id!r} in this fleet.")


class UnknownNameError(IvegError):
    """Nothing of a kind has this id."""

    def __init__(self, kind: str, name: str) -> None:
        super().__init__(f"There is no {kind} {name!r}.")


class NotANameError(IvegError):
    """No account may have this name."""

    def __init__(self, name: str) -> None:
        # Orion refuses these characters, and the name goes with each STOP.
        rule = (
            "1 to 64 visible characters, none of < > \" ' = ; ( ), and nobody "
            "else's, such as console, program or operator"
        )
        super().__init__(f"{name!r} cannot be a name: it must be {rule}.")


class NameTakenError(IvegError):
    """Another account has this name or one that looks like it."""

    def __init__(self, name: str) -> None:
        super().__init__(f"Somebody is called {name!r} already.")


class RefusedError(IvegError):
    """An act is refused now; STOP never is.

    Attributes:
        why: Stable code of the reason.
    """

    def __init__(self, why: str, sentence: str) -> None:
        super().__init__(sentence)
        self.why = why


class CommandRefusedError(RefusedError):
    """A release, resume or goal is refused.

    Args:
        why: Code of the reason.
        because: Reason in words; None: the code is shown.
    """

    def __init__(
        self, robot_id: str, order: str, why: str, because: str | None = None
    ) -> None:
        super().__init__(why, f"{order} of {robot_id} refused: {because or why}.")


class MarkRefusedError(RefusedError):
    """A mark "not a person here" is refused.

    ``why`` is ``somebody`` or ``too_many``.
    """

    def __init__(self, why: str) -> None:
        super().__init__(why, f"It may not be marked as no person: {why}.")


class TrialRefusedError(RefusedError):
    """The trial of a rule cannot begin, end or be promoted now.

    ``why`` is ``running`` (another trial), ``same`` (as the rule in force) or ``none``.
    """

    def __init__(self, why: str) -> None:
        super().__init__(why, f"That is not possible with the trial of a rule: {why}.")


class OutdatedError(IvegError):
    """A change rests on an older version."""

    def __init__(self, what: str, seen: int, now: int) -> None:
        super().__init__(f"{what} is at version {now}; you have seen version {seen}.")


class VersionMissingError(IvegError):
    """A change does not name the version that it rests on."""

    def __init__(self, what: str) -> None:
        super().__init__(f"{what} is changed by naming the version that was seen.")


class BusyError(IvegError):
    """More sign-ins wait than are served soon."""

    def __init__(self) -> None:
        super().__init__("Too many people sign in at once; try again.")


class NotAllowedError(IvegError):
    """The role of a known caller does not permit the act."""

    def __init__(self, action: str, role: str) -> None:
        super().__init__(f"{role} may not {action}.")


class SignOnError(IvegError):
    """A sign-in at the identity provider failed.

    Attributes:
        failure: One of ``SignOnFailure``; each has a sentence on the page.
        detail: For the log and the audit; holds no token.
    """

    def __init__(self, failure: str, detail: str = "") -> None:
        super().__init__(f"{failure}: {detail}" if detail else failure)
        self.failure = failure
        self.detail = detail


class ProvidedAccountError(IvegError):
    """Only the identity provider can change this of its account."""

    def __init__(self, name: str) -> None:
        super().__init__(f"{name} signs in at the identity provider, as it says.")


class VitalPartError(IvegError):
    """A part has ended that STOP or speed limits need."""

    def __init__(self, part: str) -> None:
        super().__init__(f"{part} has ended, and iVeg with it; robots slow and stand.")


class HopError(IvegError):
    """A neighbour of iVeg failed.

    Attributes:
        hop: The neighbour: ``mqtt``, ``orion``, ``iot_agent``, ``database``.
    """

    def __init__(self, hop: str, detail: str) -> None:
        super().__init__(f"{hop}: {detail}")
        self.hop = hop
        self.detail = detail


class NoAnswerError(HopError):
    """A neighbour accepted a request and did not answer in time."""
