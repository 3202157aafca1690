"""JSON documents: strict parsing, and checks of format, version and schema, for all kinds of them."""

from __future__ import annotations

import json
from collections import Counter
from datetime import date
from functools import cache
from importlib.resources import files
from itertools import islice
from pathlib import Path
from typing import Any, Final, cast

import numpy as np

from .errors import InstanceError, naming, shortened
from .input_limits import MAX_BYTES
from .storage import read_bytes

_MOST_ERRORS: Final = 100  # of a document; the outermost of them is reported
_FEW_ROWS: Final = 100


def decode_json(data: bytes) -> str:
    """The text of a JSON file. Raises InstanceError for other content and for more than MAX_BYTES bytes."""
    if len(data) > MAX_BYTES:
        raise InstanceError(f"has {len(data)} bytes of JSON; at most {MAX_BYTES} are read, write it as .npz")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise InstanceError("is neither JSON nor .npz; expected a file written by crossfield") from error


def parse_json(text: str) -> object:
    """Parse JSON text, with or without byte order mark. Raises InstanceError with the line."""
    try:
        return cast("object", json.loads(text.removeprefix("\ufeff"), object_pairs_hook=_unique_keys))
    except (ValueError, RecursionError) as error:
        raise InstanceError(f"is not valid JSON: {shortened(error)}") from error


def _unique_keys(pairs: list[tuple[str, object]]) -> dict[str, object]:
    """An object of a JSON document. Refuses repeated keys, because programs differ on which one counts."""
    document = dict(pairs)
    if len(document) < len(pairs):
        ((name, _),) = Counter(name for name, _ in pairs).most_common(1)
        raise ValueError(f"the key {shortened(name)!r} appears twice")
    return document


def read_document(
    path: Path, form: str, version: int, schema: str, package: str, *, remedy: str
) -> dict[str, Any]:
    """Return the JSON document in a file, if it has this format and version and obeys the schema.

    Raises InputError when the file cannot be read, and InstanceError with file and place.
    """
    try:
        text = read_bytes(path, MAX_BYTES).decode()
    except UnicodeDecodeError as error:
        raise InstanceError(f"is not JSON; {remedy}", file=path) from error
    with naming(path):
        document = parse_json(text)
        _check_writable(document)
        check_version(document, form, version)
        return check_schema(document, schema, package)


def stated_format(path: Path) -> object:
    """The format that a JSON document in a file states; None for other content. Raises InputError."""
    try:
        document = json.loads(read_bytes(path, MAX_BYTES))
    except (ValueError, RecursionError):
        return None
    return document.get("format") if isinstance(document, dict) else None


def _check_writable(document: object) -> None:
    """Raise InstanceError unless the document can be written as JSON in UTF-8 again."""
    try:  # Python reads infinite numbers and halves of surrogate pairs, other programs need not
        json.dumps(document, ensure_ascii=False, allow_nan=False).encode()
    except UnicodeEncodeError as error:
        raise InstanceError("has a text with half of a surrogate pair; write it again") from error
    except ValueError as error:
        raise InstanceError("has a number that is not finite; write it again") from error


def check_schema(document: object, schema: str, package: str) -> dict[str, Any]:
    """Return the document if it obeys the `<schema>.schema.json` of a package; else raise InstanceError."""
    assert isinstance(document, dict)
    error = schema_error(document, schema, package)
    if error is not None:
        raise InstanceError(f"{error.json_path}: {shortened(error.message, 200)}")
    return document


def schema_error(document: dict[str, Any], schema: str, package: str) -> Any | None:
    """The outermost jsonschema.ValidationError of a document, None when it obeys its schema."""
    import jsonschema

    formats = jsonschema.FormatChecker(formats=())
    formats.checks("line")(lambda text: not isinstance(text, str) or text.isprintable())
    formats.checks("day", ValueError)(
        lambda text: not isinstance(text, str) or bool(date.fromisoformat(text))
    )
    validator = jsonschema.Draft202012Validator(_schema(schema, package), format_checker=formats)
    # jsonschema takes a minute for the rows of a large grid.
    if validator.is_valid({key: _extreme_rows(value) for key, value in document.items()}):
        return None
    first = islice(validator.iter_errors(document), _MOST_ERRORS)
    return min(first, key=lambda e: (len(e.absolute_path), str(e.absolute_path)), default=None)


def _extreme_rows(rows: Any) -> Any:
    """Few rows of many, which obey a schema of numbers within limits if and only if all do.

    They hold the least and the greatest number of each column, a number that is not whole, and a null. Few
    rows, and rows of anything else, are returned as they are.
    """
    if not isinstance(rows, list) or len(rows) <= _FEW_ROWS:
        return rows
    is_table = all(type(row) is list and row and len(row) == len(rows[0]) for row in rows)
    columns = list(zip(*rows, strict=True)) if is_table else [rows]
    if any(not {*map(type, column)} <= {int, float, type(None)} for column in columns):
        return rows
    chosen = []
    for column in columns:
        numbers = [number for number in column if number is not None] or [None]
        broken = next((number for number in numbers if number is not None and number % 1), numbers[0])
        ends = (min(numbers), max(numbers)) if None not in numbers else ()
        chosen.append([broken, *ends, *[None] * (len(numbers) < len(column))])
    count = max(map(len, chosen))
    few = [[column[min(at, len(column) - 1)] for column in chosen] for at in range(count)]
    return few if is_table else [row[0] for row in few]


@cache
def _schema(name: str, package: str) -> dict[str, Any]:
    text = files(package).joinpath(f"{name}.schema.json").read_text("utf-8")
    return cast("dict[str, Any]", json.loads(text))


def check_version(document: object, form: str, version: int) -> None:
    """Raise InstanceError unless the document states this format and version."""
    if not isinstance(document, dict) or document.get("format") != form:
        raise InstanceError(f'is not a file of this kind: "format" must be "{form}"')
    stated = document.get("version")
    if stated != version or isinstance(stated, bool):
        raise InstanceError(
            f"has version {str(stated)[:20]}, but this program reads version {version}; write it again"
        )


def parse_head(arrays: dict[str, np.ndarray[Any, Any]]) -> dict[str, Any]:
    """The parsed JSON text in the array `head`. Raises InstanceError."""
    try:
        head = parse_json(arrays["head"].tobytes().decode())
    except (UnicodeDecodeError, InstanceError) as error:
        raise InstanceError("its array 'head' is not JSON text") from error
    return cast("dict[str, Any]", head)
