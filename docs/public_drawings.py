"""Collect drawings of public repositories: `python docs/public_drawings.py CLONES FOLDER`.

CLONES has a clone of each repository of `COLLECTIONS` in a folder of the same name. FOLDER gets a folder
for each collection, for `python docs/proofs.py --measure collections --sketches FOLDER`. The drawings are not
part of this project, and some state no licence.
"""

from __future__ import annotations

import argparse
import shutil
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final

_BEND: Final = "papers/supplemental_material/Sketches"


@dataclass(frozen=True)
class Collection:
    """Drawings of a repository: patterns of their paths, and parts of a name that leave a file out."""

    repository: str
    patterns: tuple[str, ...]
    without: tuple[str, ...] = ()


COLLECTIONS: Final = {
    "AlphaContours": Collection("bmpix/AlphaContours", ("paper/input/*.svg",), ("_SA",)),
    "BendFields": Collection(
        "emmanueliarussi/emmanueliarussi.github.io",
        (f"{_BEND}/*/input_layers/*.png", f"{_BEND}/*/*/input_layers/*.png"),
    ),
    "CASSIE": Collection("V-Sekai/cassie-data", ("data/curves/[a-z]*.curves",)),
    "StrokeStrip": Collection("davepagurek/StrokeStrip", ("examples/study_inputs/*.scap",)),
    "Virtual Sketching": Collection(
        "MarkMoHR/virtual_sketching",
        ("sample_inputs/*_line_drawings/*.png", "sample_inputs/rough_sketches/*.png"),
    ),
}


def clone_of(clones: Path, collection: Collection) -> Path:
    """The folder of the repository's clone."""
    return clones / collection.repository.rpartition("/")[2]


def files(clones: Path, collection: Collection) -> Iterator[Path]:
    """The files of a collection, in the order of their paths."""
    root = clone_of(clones, collection)
    for pattern in collection.patterns:
        for path in sorted(root.glob(pattern)):
            if not any(part in path.name for part in collection.without):
                yield path


def name_of(path: Path) -> str:
    """The name of the copy: layers of BendFields get the name of their sketch, and masks the usual ending."""
    if path.parent.name != "input_layers":
        return f"{path.parent.name}_{path.name}" if path.suffix == ".png" else path.name
    sketch = path.relative_to(next(parent for parent in path.parents if parent.name == "Sketches")).parts[0]
    words = path.stem.split("_")
    layer = next(word for word in words if word not in {"input", "mask"})
    return f"{sketch}_{layer}{'_mask' if 'mask' in words else ''}.png"


def collect(clones: Path, folder: Path) -> None:
    """Copy all drawings."""
    for name, collection in COLLECTIONS.items():
        (folder / name).mkdir(parents=True, exist_ok=True)
        for path in files(clones, collection):
            shutil.copyfile(path, folder / name / name_of(path))


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="Collect drawings of public repositories.")
    parser.add_argument("clones", type=Path, help="folder of the clones")
    parser.add_argument("folder", type=Path, help="folder of the drawings")
    arguments = parser.parse_args()
    for listed in COLLECTIONS.values():
        if not (folder := clone_of(arguments.clones, listed)).is_dir():
            parser.error(f"there is no {folder}: clone {listed.repository} from GitHub into it")
    collect(arguments.clones, arguments.folder)
