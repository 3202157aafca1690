"""Crossfield: from a rough concept sketch to optimization instances, and from solvers' answers back to a cross field.

The verbs are imported on first use, so that `import crossfield` itself takes milliseconds.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from .models.errors import CrossfieldError as CrossfieldError
    from .models.field import CrossField as CrossField
    from .models.instance import Instance as Instance
    from .models.instance_file import read_instance as read_instance
    from .models.instance_file import write_instance as write_instance

_HOME: Final = {
    "CrossField": ".models.field",
    "CrossfieldError": ".models.errors",
    "Instance": ".models.instance",
    "read_instance": ".models.instance_file",
    "write_instance": ".models.instance_file",
}

__all__ = sorted(_HOME)  # noqa: PLE0605


def __getattr__(name: str) -> Any:
    """The public object of that name, imported now."""
    if name not in _HOME:
        raise AttributeError(f"module 'crossfield' has no attribute {name!r}")
    return getattr(import_module(_HOME[name], __name__), name)


def __dir__() -> list[str]:
    """The public names."""
    return sorted({*globals(), *_HOME})
