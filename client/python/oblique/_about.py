"""What a report of a defect should tell."""

from __future__ import annotations

import os
import platform
import sys
from importlib import metadata

import numpy as np

from . import _core


def about() -> str:
    """Versions and what the solver finds here, a line each, for a report of a defect: what
    ``python3 -m oblique`` prints. It names no machine, and the home folder is ~."""
    origin = _core.origin()
    home = os.path.expanduser("~")
    folder = os.path.dirname(os.path.abspath(__file__))
    if home != "/" and folder.startswith(home + os.sep):
        folder = "~" + folder[len(home) :]
    cores = len(os.sched_getaffinity(0))
    lines = {
        "oblique": origin["version"],
        "built": f"{origin['compiler']}, {origin['build_type']}",
        "folder": folder,
        "instructions": _core.instruction_set(),
        "cores": f"{cores} of the machine's {os.cpu_count()}",
        "Python": f"{platform.python_version()}, {platform.python_implementation()}",
        "NumPy": np.__version__,
        "pandas": _version("pandas"),
        "system": f"{platform.system()} {platform.release()}, {platform.machine()}, "
        + " ".join(platform.libc_ver()),
    }
    return "\n".join(f"{name:13} {text}" for name, text in lines.items())


def _version(package: str) -> str:
    if package in sys.modules:
        return str(sys.modules[package].__version__)
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return "not here"
