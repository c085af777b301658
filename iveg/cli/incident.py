"""``iveg incident``: looks whether an incident pack is as it was made."""

from iveg.adapters.incident_files import verify_pack
from iveg.cli.arguments import CommandCall


def run(call: CommandCall) -> int:
    """Verify a pack; returns the exit code.

    Raises:
        DataFileError: it is no pack.
    """
    end, wrong = verify_pack(call.options.file)
    for sentence in wrong:
        print(sentence)
    if not wrong:
        print(f"Nothing in it was changed. Its chain ends with {end}.")
        print("The log of the iVeg that made it has the same end.")
    return 1 if wrong else 0
