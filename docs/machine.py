"""The machine on which numbers were measured, without the name of the host."""

from __future__ import annotations

import os
import platform
import re
from pathlib import Path
from typing import Any


def processor_name() -> str:
    """The model of the processor."""
    info = Path("/proc/cpuinfo")
    model = re.search(r"model name\s*:\s*(.+)", info.read_text()) if info.exists() else None
    return model[1] if model else platform.machine()


def machine_facts() -> dict[str, Any]:
    """Processor, cores and load of a measurement."""
    return {
        "processor": processor_name(),
        "cores": len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count(),
        "python": platform.python_version(),
        "load": os.getloadavg()[0],
    }
