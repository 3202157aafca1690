"""Declaration of commands. Options that several of them share are the fields of a dataclass."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import MISSING, fields, is_dataclass
from functools import wraps
from inspect import Parameter, Signature, signature
from typing import Any, get_type_hints

import typer

from .help_texts import Command


def command(app: typer.Typer, name: str) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Decorator that adds a function to the app as a command of this name."""
    return lambda function: app.command(name, cls=Command)(_expand_option_groups(function))


def _expand_option_groups(function: Callable[..., None]) -> Callable[..., None]:
    """Command in which each parameter whose type is a dataclass is replaced by one option per field.

    typer reads the options from the signature of the command. The function receives the dataclass.
    """
    hints = get_type_hints(function, include_extras=True)
    groups: dict[str, Any] = {name: hint for name, hint in hints.items() if is_dataclass(hint)}
    parameters = [
        option
        for name, parameter in signature(function).parameters.items()
        for option in (
            _option_parameters(groups[name])
            if name in groups
            else [parameter.replace(annotation=hints[name])]
        )
    ]

    @wraps(function)
    def wrapped(*arguments: Any, **values: Any) -> None:
        for name, group in groups.items():
            names = [field.name for field in fields(group) if field.name in values]
            values[name] = group(**{option: values.pop(option) for option in names})
        function(*arguments, **values)

    wrapped.__signature__ = Signature(parameters)  # type: ignore[attr-defined]
    wrapped.__annotations__ = {option.name: option.annotation for option in parameters}
    return wrapped


def _option_parameters(group: Any) -> Iterator[Parameter]:
    """One keyword parameter per field of a dataclass."""
    hints = get_type_hints(group, include_extras=True)
    for field in fields(group):
        default = Parameter.empty if field.default is MISSING else field.default
        yield Parameter(field.name, Parameter.KEYWORD_ONLY, default=default, annotation=hints[field.name])
