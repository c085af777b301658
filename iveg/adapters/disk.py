"""Room on the disk of a directory."""

import shutil
from pathlib import Path

from iveg.domain.disk_space import DiskSpace


def disk_space(directory: Path) -> DiskSpace:
    """Room on the disk of a directory.

    Raises:
        OSError: it cannot be read.
    """
    usage = shutil.disk_usage(directory)
    return DiskSpace(usage.free, usage.total)
