"""Declaration of commands. Options that several of them share are the fields of a dataclass."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields, is_dataclass
from functools import wraps
from inspect import Parameter, Signature, signature
from typing import Any, get_type_hints

import typer

from .help_texts import Command


def command(app: typer.Typer, name: str, example: str) -> Callable[[Callable[..., None]], Any]:
    """Decorator that adds a function to the app as a command of this name; the example ends its help."""
    add = app.command(name, cls=Command, epilog=f"Example: {example}")
    return lambda function: add(_expand_option_groups(function))


def _expand_option_groups(function: Callable[..., None]) -> Callable[..., None]:
    """Command in which each parameter whose type is a dataclass is replaced by one option per field.

    typer reads the options from the signature of the command. The function receives the dataclass.
    """
    groups: dict[str, Any] = {}
    parameters: list[Parameter] = []
    for parameter in _parameters(function):
        if is_dataclass(group := parameter.annotation):
            groups[parameter.name] = group
            parameters += [option.replace(kind=Parameter.KEYWORD_ONLY) for option in _parameters(group)]
        else:
            parameters.append(parameter)

    @wraps(function)
    def wrapped(*arguments: Any, **values: Any) -> None:
        for name, group in groups.items():
            names = [field.name for field in fields(group) if field.name in values]
            values[name] = group(**{option: values.pop(option) for option in names})
        function(*arguments, **values)

    wrapped.__signature__ = Signature(parameters)  # type: ignore[attr-defined]
    wrapped.__annotations__ = {option.name: option.annotation for option in parameters}
    return wrapped


def _parameters(target: Any) -> list[Parameter]:
    """Parameters of a function or a dataclass, with their types instead of the names of these."""
    hints = get_type_hints(target, include_extras=True)
    return [option.replace(annotation=hints[option.name]) for option in signature(target).parameters.values()]
