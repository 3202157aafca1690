"""JSON documents: strict parsing, and checks of format, version and schema, for all kinds of them."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Iterable
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
_ENDS: Final = ("minimum", "exclusiveMinimum", "maximum")


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
    rules = _schema(schema, package)
    validator = jsonschema.Draft202012Validator(rules, format_checker=formats)
    first = islice(validator.iter_errors(_without_checked_rows(document, rules)), _MOST_ERRORS)
    return min(first, key=lambda e: (len(e.absolute_path), str(e.absolute_path)), default=None)


def _without_checked_rows(document: dict[str, Any], rules: dict[str, Any]) -> dict[str, Any]:
    """The document, in which lists of numbers that obey their schema have their first entry only.

    jsonschema takes a minute for the rows of a large grid, and NumPy a moment.
    """
    case: dict[str, Any] = {}
    if "if" in rules:
        case = rules["then" if document.keys() >= set(rules["if"]["required"]) else "else"]["properties"]
    checked = {}
    for key, rows in document.items():
        rule = case.get(key) or rules["properties"].get(key) or {}
        items = rule.get("items", {})
        items = rules["$defs"][items["$ref"].rpartition("/")[2]] if "$ref" in items else items
        if isinstance(rows, list) and "maxItems" not in rule and _all_obey(rows, items):
            checked[key] = rows[:1]
    return document | checked


def _all_obey(rows: list[Any], items: dict[str, Any]) -> bool:
    """Whether all entries obey a schema of numbers, or of rows of numbers of one length."""
    if items.get("type") != "array":
        return _are_in_range(rows, items)
    columns = items.get("prefixItems") or [items["items"]] * items["minItems"]
    if not all(type(row) is list and len(row) == len(columns) for row in rows):
        return False
    return items["minItems"] == items["maxItems"] and all(
        map(_are_in_range, zip(*rows, strict=True), columns)
    )


def _are_in_range(values: Iterable[Any], rule: dict[str, Any]) -> bool:
    """Whether all values obey a schema of a number or of null; False for a schema of something else."""
    kinds = {rule["type"]} if isinstance(rule.get("type"), str) else set(rule.get("type", ()))
    if not kinds & {"number", "integer"} or not rule.keys() <= {"type", "description", *_ENDS}:
        return False
    numbers = [value for value in values if not (value is None and "null" in kinds)]
    if not set(map(type, numbers)) <= {int, float}:
        return False
    try:
        array = np.array(numbers, dtype=np.float64)
    except OverflowError:
        return False
    least, above, most = map(rule.get, _ENDS, (-np.inf, -np.inf, np.inf))
    good = (array >= least) & (array > above) & (array <= most)
    return bool(good.all() and ("number" in kinds or (array == np.floor(array)).all()))


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
