"""Changes of a library by somebody who wants to hide them."""

import hashlib
import json


def sha256(data):
    return hashlib.sha256(data).hexdigest()


def change(path, **given):
    """Change keys of a JSON document; keys of parts of it are written a__b."""
    document = json.loads(path.read_text())
    for key, value in given.items():
        *parts, last = key.split("__")
        part = document
        for name in parts:
            part = part[name]
        part[last] = value(part[last]) if callable(value) else value
    path.write_text(json.dumps(document))


def seal(folder):
    """Make all checksums fit again, as somebody would who wants to hide a change."""
    sidecars = [
        path for path in folder.glob("*.json") if path.name.count(".") == 1 and path.name.startswith("cf_")
    ]
    for path in [*sidecars, *folder.glob("*.about.json")]:
        document = json.loads(path.read_text())
        for file in document["files"]:
            held = folder / file["name"]
            if held.is_file() and held.parent == folder:
                file |= {"bytes": held.stat().st_size, "sha256": sha256(held.read_bytes())}
        path.write_text(json.dumps(document))
    sums = {path.stem: sha256(path.read_bytes()) for path in sidecars}
    if (folder / "library.json").is_file():
        change(folder / "library.json", sha256=sums)
    sums = "".join(
        f"{sha256(path.read_bytes())}  {path.name}\n"
        for path in sorted(folder.iterdir())
        if path.is_file() and path.name != "SHA256SUMS"
    )
    (folder / "SHA256SUMS").write_text(sums)
