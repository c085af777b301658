"""``iveg incident``: looks whether an incident pack is as it was made."""

import argparse

from iveg.adapters.incident_files import verify_pack


def run_incident(options: argparse.Namespace) -> int:
    """Verify a pack; returns the exit code.

    Raises:
        DataFileError: it is no pack.
    """
    end, wrong = verify_pack(options.file)
    for sentence in wrong:
        print(sentence)
    if not wrong:
        print(f"Nothing in it was changed. Its chain ends with {end}.")
        print("The log of the iVeg that made it has the same end.")
    return 1 if wrong else 0
