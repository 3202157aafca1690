"""Changes of a library by somebody who wants to hide them."""

import hashlib
import json


def change(path, **changes):
    """Change keys of a JSON document, laid out as in a library; keys of parts of it are written a__b."""
    text = path.read_text()
    document = json.loads(text)
    for key, value in changes.items():
        *parts, last = key.split("__")
        part = document
        for name in parts:
            part = part[name]
        part[last] = value(part.get(last)) if callable(value) else value
    path.write_text(json.dumps(document, indent=1, ensure_ascii=text.isascii()) + "\n")


def seal(folder):
    """Make all checksums fit again, as somebody would who wants to hide a change."""
    lines = (
        f"{hashlib.sha256(path.read_bytes()).hexdigest()}  {path.name}\n"
        for path in sorted(folder.iterdir())
        if path.is_file() and path.name != "SHA256SUMS" and not path.name.startswith(".")
    )
    (folder / "SHA256SUMS").write_text("".join(lines))
