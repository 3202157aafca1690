"""A library as a static site: a table of entries, a page for each, pictures, and every file in files/.

Links are relative, pages contact no other server, and only sorting and filtering need JavaScript. The
templates, templates/site/*.html.j2, escape every text from a file.
"""

from __future__ import annotations

import shutil
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from importlib.resources import files
from pathlib import Path
from typing import Any, Final

from .... import templates
from ....models.errors import InputError, OutputError
from ....models.field.file import read_field
from ....models.formulations.catalogue import FORMULATIONS
from ....models.instance.file import read_instance
from ....models.processes.deadline import Progress, silent
from ....models.storage import make_folder, neighbour, read_bytes, remove_dead, write_bytes
from ....templates import ENVIRONMENT
from ...formats.registry import FORMATS
from ...pictures.draw import count_singularities
from ...pictures.web import field_picture, instance_picture, thumbnail
from ..building.index import SOLU
from ..building.table import role_of
from ..documents.checksums import SUMS, is_intact, read_checksums
from ..documents.documents import Library, about_file, files_of_instance, read_about, read_library
from ..plan.spec import RUNGS

ASSETS: Final = ("site.css", "site.js", "icon.svg")  # copied from the templates
FOLDERS: Final = ("entry", "files", "instance", "pictures")
PAGES: Final = ("index.html", "about.html")

_SHOWN: Final = {".svg", ".png"}
_ROLES: Final = {
    "least_2": "field of least known 2-norm energy",
    "least_1": "field of least known 1-norm energy",
    "least_mixed": "field of least known energy in the mixed norm",
    "baseline": "baseline field, whose jumps are the data of qp-fixed",
}


@dataclass(frozen=True)
class FieldPicture:
    """A displayed field. roles: keys of _ROLES; facts: provenance; singular: its singularities in words."""

    roles: tuple[str, ...]
    caption: str
    facts: dict[str, Any]
    file: str
    singular: str


@dataclass
class InstancePages:
    """A displayed instance."""

    about: dict[str, Any]
    entries: list[dict[str, Any]]
    label: str
    pictures: list[FieldPicture] = field(default_factory=list)
    drawings: list[str] = field(default_factory=list)

    @property
    def name(self) -> str:
        """Its name."""
        return str(self.about["name"])

    @property
    def suffix(self) -> str:
        """Suffix of its pictures."""
        return "png" if "faces" in self.about["instance"] else "svg"

    def picture_of(self, entry: dict[str, Any]) -> FieldPicture:
        """Return the field shown with an entry: the best in its norm, or the field with its jumps."""
        return next(picture for picture in self.pictures if role_of(entry) in picture.roles)


def write_site(folder: str | Path, output: str | Path, progress: Progress = silent) -> list[Path]:
    """Write the site of a library and return its pages; an earlier site in `output` is replaced.

    Raises InputError, InstanceError for a missing or damaged library, OutputError if `output` cannot be
    written or holds something other than a site.
    """
    library = read_library(folder)
    if Path(output).resolve().is_relative_to(library.folder.resolve()):
        raise OutputError(
            "lies inside the library, whose files are its own; choose another folder", file=output
        )
    sums = read_checksums(library.folder)
    shown = _instances(library, sums)
    with _replace_folder(Path(output)) as stage:
        for name in FOLDERS:
            make_folder(stage / name)
        for name in ASSETS:
            write_bytes(stage / name, files(templates).joinpath("site", name).read_bytes())
        progress("files")
        _copy_files(library.folder, sums, stage / "files")
        for instance in shown:
            progress(f"pictures of {instance.name}")
            _draw_pictures(library.folder, instance, stage / "pictures")
        progress("pages")
        pages = _write_pages(library, shown, sums, stage)
    return [Path(output) / page for page in pages]


def _instances(library: Library, names: Iterable[str]) -> list[InstancePages]:
    """The instances of a library with their entries, in its order."""
    grouped: dict[str, list[dict[str, Any]]] = {}
    for entry in library.entries:
        grouped.setdefault(entry["instance"]["file"].removesuffix(".instance.json"), []).append(entry)
    instances = []
    for name, entries in grouped.items():
        about = read_about(library.folder / about_file(name))
        drawings = sorted(name for name in names if name.startswith(f"cf_{entries[0]['family']}."))
        source = entries[0]["source"]
        seed = "" if source["seed"] is None else f" s{source['seed']}"
        label = f"{source['size']}{seed}{' box' if source['gauge'] == 'box' else ''}"
        instances.append(InstancePages(about, entries, label, drawings=drawings))
    return instances


def _copy_files(folder: Path, sums: dict[str, str], target: Path) -> None:
    """Copy every file of the library into a folder. Raises InputError for symbolic links and other files.

    A hard link would save space, but whoever edits a file of the site would edit the library.
    """
    for name in (*sums, SUMS):
        if (folder / name).is_symlink():
            raise InputError(
                "is a symbolic link, and a site publishes plain files alone; put the file in its place",
                file=folder / name,
            )
    for name in sums:
        if not is_intact(folder, name, sums):
            raise InputError(
                "is missing or differs from SHA256SUMS; build the library again", file=folder / name
            )
    for name in (*sums, SUMS):
        shutil.copyfile(folder / name, target / name)


def _draw_pictures(folder: Path, shown: InstancePages, target: Path) -> None:
    """Write the pictures of an instance and of each of its different fields."""
    instance = read_instance(folder / shown.about["instance"]["file"])
    write_bytes(target / f"{shown.name}.{shown.suffix}", instance_picture(instance))
    write_bytes(target / f"{shown.name}.thumb.{shown.suffix}", thumbnail(instance))
    roles_of: dict[str, list[str]] = {}
    for role in _ROLES:
        roles_of.setdefault(shown.about["fields"][role]["file"], []).append(role)
    for file, roles in roles_of.items():
        field = read_field(folder / file)
        name = f"{file.removesuffix('.json')}.{shown.suffix}"
        write_bytes(target / name, field_picture(field))
        caption, facts = "; ".join(_ROLES[role] for role in roles), shown.about["fields"][roles[0]]
        shown.pictures.append(FieldPicture(tuple(roles), caption, facts, name, count_singularities(field)))


def _write_pages(
    library: Library, shown: list[InstancePages], sums: dict[str, str], stage: Path
) -> list[Path]:
    """Write every page and return their paths inside the site."""
    environment = ENVIRONMENT.overlay()
    environment.filters = ENVIRONMENT.filters | {
        function.__name__: function for function in (count, value, exact, percent, size)
    }
    environment.globals = ENVIRONMENT.globals | {"shown_types": _SHOWN}
    families: dict[str, list[InstancePages]] = {}
    for instance in shown:
        families.setdefault(instance.about["family"], []).append(instance)
    common = {
        "library": library.document,
        "release": library.document["spec"].get("release", {}),
        "entries": library.entries,
        "instances": shown,
        "instance_of": {entry["name"]: instance for instance in shown for entry in instance.entries},
        "families": families,
        "faces": {name: max(members, key=_detail_rank) for name, members in families.items()},
        "tokens": {name: declared.short for name, declared in FORMULATIONS.items()},
        "sizes": {name: (library.folder / name).stat().st_size for name in (*sums, SUMS)},
        "sums": sums,
        "licences": sorted({entry["licence"] or "" for entry in library.entries}),
    }
    written = []

    def write(path: str, template: str, **context: Any) -> None:
        root = "../" * path.count("/")
        text = environment.get_template(f"site/{template}.html.j2").render(common, root=root, **context)
        write_bytes(stage / path, text.encode())
        written.append(Path(path))

    present = {file["format"] for entry in library.entries for file in entry["files"]}
    write("index.html", "index", choices=_choices(library.entries))
    write(
        "about.html",
        "about",
        formats=[file_format for name, file_format in FORMATS.items() if name in present],
        citation=read_bytes(library.folder / "CITATION.cff").decode(),
        licence=read_bytes(library.folder / "LICENSE").decode(),
        solu=SOLU,
    )
    for instance in shown:
        write(
            f"instance/{instance.name}.html",
            "instance",
            shown=instance,
            files=files_of_instance(instance.about),
        )
        for entry in instance.entries:
            write(f"entry/{entry['name']}.html", "entry", shown=instance, entry=entry)
    return written


def _detail_rank(shown: InstancePages) -> tuple[int, bool]:
    """Sort key for the picture of a sketch: the largest grid, in the gauge `strokes`."""
    source = shown.entries[0]["source"]
    return source["size"], source["gauge"] == "strokes"


def _choices(entries: tuple[dict[str, Any], ...]) -> dict[str, list[str]]:
    """The choices of the filters of the table."""
    keys = ("family", "rung", "formulation", "class", "difficulty", "status")
    choices = {key: list(dict.fromkeys(entry[key] for entry in entries)) for key in keys}
    return choices | {"rung": [name for name in RUNGS if name in choices["rung"]]}


def count(number: int) -> str:
    """Return a whole number with narrow spaces between its thousands."""
    return f"{number:,}".replace(",", "\u202f")


def value(number: float | None) -> str:
    """Return a number to six digits, a dash for none."""
    return "–" if number is None else f"{number + 0.0:.6g}".replace("-", "−")


def exact(number: float) -> str:
    """Return a number with all its digits."""
    return repr(number + 0.0)


def percent(share: float | None) -> str:
    """Return a share in percent to three digits, a dash for none."""
    if share is None:
        return "–"
    return "≈ 0\u202f%" if 0 < share < 1e-6 else f"{100 * share:.3g}\u202f%"


def size(number: int) -> str:
    """Return bytes as B, kB or MB."""
    for unit, name in ((1e6, "MB"), (1e3, "kB")):
        if number >= unit:
            return f"{number / unit:.3g}\u202f{name}"
    return f"{number}\u202fB"


@contextmanager
def _replace_folder(output: Path) -> Iterator[Path]:
    """Yield an empty folder that replaces an earlier site on success. Raises OutputError."""
    output = output.resolve()
    if output.exists() and not output.is_dir():
        raise OutputError("is a file; name a folder for the site", file=output)
    try:
        known = {*FOLDERS, *PAGES, *ASSETS}
        strange = sorted({path.name for path in output.iterdir()} - known) if output.exists() else []
        if strange:
            raise OutputError(
                f"holds {strange[0]!r}, which is no part of a site; choose another folder", file=output
            )
        make_folder(output.parent)
        remove_dead(output.parent)
        stage = neighbour(output)
        stage.mkdir()
        try:
            yield stage
            _take_place(stage, output)
        finally:
            shutil.rmtree(stage, ignore_errors=True)
    except OSError as error:
        raise OutputError(
            f"cannot be written: {error.strerror}; free some space or choose another folder", file=output
        ) from error


def _take_place(stage: Path, output: Path) -> None:
    """Rename the new folder to the old one's name; restore the old one if that fails."""
    old = neighbour(output)
    if output.exists():
        output.rename(old)
    try:
        stage.rename(output)
    except OSError:
        if old.exists():
            old.rename(output)
        raise
    shutil.rmtree(old, ignore_errors=True)
