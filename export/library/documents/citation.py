"""Citation and licences of a library, as its specification states them for each sketch.

The paper is cited by its title alone, because nothing else about it is certain.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any, Final

from ..plan.spec import Sketch, Spec

_COMMONS: Final = "https://creativecommons.org"
LICENCES: Final = {
    "CC0-1.0": ("Creative Commons Zero 1.0 Universal (CC0 1.0)", f"{_COMMONS}/publicdomain/zero/1.0/"),
    **{
        f"CC-{letters.upper()}-4.0": (
            f"Creative Commons {words} 4.0 International (CC {letters.upper()} 4.0)",
            f"{_COMMONS}/licenses/{letters}/4.0/",
        )
        for letters, words in {
            "by": "Attribution",
            "by-sa": "Attribution-ShareAlike",
            "by-nc": "Attribution-NonCommercial",
            "by-nd": "Attribution-NoDerivatives",
            "by-nc-sa": "Attribution-NonCommercial-ShareAlike",
            "by-nc-nd": "Attribution-NonCommercial-NoDerivatives",
        }.items()
    },
    "MIT": ("MIT licence", "https://opensource.org/license/mit"),
}

PAPER: Final = (
    "Extrapolating curvature lines in rough concept sketches using mixed-integer nonlinear optimization"
)
BENDFIELDS: Final = {
    "author": "Iarussi, Emmanuel and Bommes, David and Bousseau, Adrien",
    "title": "BendFields: Regularized curvature fields from rough concept sketches",
    "journal": "ACM Transactions on Graphics",
    "volume": "34",
    "number": "3",
    "pages": "24:1--24:16",
    "year": "2015",
    "doi": "10.1145/2710026",
}
REFERENCES: Final = (
    f"{PAPER}: the formulations, whose equation numbers are in the names of the rows",
    (
        "E. Iarussi, D. Bommes and A. Bousseau: BendFields: Regularized curvature fields from rough concept "
        "sketches, ACM Transactions on Graphics 34 (2015), no. 3, 24:1-24:16, doi:10.1145/2710026: "
        "the problem"
    ),
)

_TEX: Final = str.maketrans(
    {"\\": r"\textbackslash{}", "~": r"\textasciitilde{}", "^": r"\textasciicircum{}"}
    | {letter: f"\\{letter}" for letter in "&%$#_{}"}
)


def cited(spec: Spec) -> dict[str, Any]:
    """Return the release as in library.json: title, authors, BibTeX, and stated version and date."""
    stated = {"authors": []} if spec.release is None else spec.release.document()
    return {"title": spec.title, **stated, "bibtex": bibtex(spec)}


def bibtex(spec: Spec) -> str:
    """Return the BibTeX entries of the library, of the paper and of BendFields."""
    release = spec.release
    fields = {"title": f"{{{spec.title.translate(_TEX)}}}"}
    if release is not None:
        fields |= {
            "author": " and ".join(map(_author, release.authors)),
            "year": release.date[:4],
            "version": release.version.translate(_TEX),
            "note": f"Version {release.version.translate(_TEX)} of {release.date}",
        }
    return "\n\n".join(
        (
            _entry("misc", "_".join([slug(spec.title, "_"), *([fields["year"]] if release else [])]), fields),
            _entry("misc", "extrapolating_curvature_lines", {"title": f"{{{PAPER}}}"}),
            _entry("article", "bendfields", BENDFIELDS | {"title": f"{{{BENDFIELDS['title']}}}"}),
        )
    )


def _entry(kind: str, key: str, fields: dict[str, str]) -> str:
    return f"@{kind}{{{key},\n" + "".join(f"  {name} = {{{text}}},\n" for name, text in fields.items()) + "}"


def slug(text: str, between: str = "-") -> str:
    """Return letters, digits and points of a text in lower case, joined by a separator."""
    return re.sub(r"[^a-z0-9.]+", between, text.lower()).strip(between + ".") or "library"


def _author(name: str) -> str:
    """An author; the name of a group is not taken apart."""
    text = name.translate(_TEX)
    return f"{{{text}}}" if name.startswith("The ") else text


def terms(sketches: Sequence[Sketch]) -> dict[str, Any]:
    """Return the licences of sketches for the texts of a library.

    licence, name: the known licence of all sketches, or empty; known: identifier, name and address of each
    known licence; lines: one per sketch with its origin.
    """
    stated = list(dict.fromkeys(each.origin.license for each in sketches))
    known = [(each, *LICENCES[each]) for each in stated if each in LICENCES]
    licence, name, _ = known[0] if len(stated) == len(known) == 1 else ("", "", "")
    return {"licence": licence, "name": name, "known": known, "lines": list(map(_line, sketches))}


def _line(sketch: Sketch) -> str:
    origin = sketch.origin
    parts = (
        origin.license or "no licence is stated; ask its author before you share it",
        origin.author and f"author: {origin.author}",
        origin.source and f"source: {origin.source}",
    )
    return f"{sketch.name}: {'; '.join(filter(None, parts))}"
