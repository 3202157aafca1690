"""Citation and licences of a library, as its specification states them for each sketch.

The paper is cited by its title alone, because nothing else about it is certain.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
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

_SPECIAL: Final = {"\\": r"\textbackslash{}", "~": r"\textasciitilde{}", "^": r"\textasciicircum{}"}
_SPECIAL_OF_TEX: Final = _SPECIAL | {letter: f"\\{letter}" for letter in "&%$#_{}"}


def cited(spec: Spec) -> dict[str, Any]:
    """Return the release as in library.json: title, authors, BibTeX, and stated version and date."""
    stated = {"authors": []} if spec.release is None else spec.release.document()
    return {"title": spec.title, **stated, "bibtex": bibtex(spec)}


def bibtex(spec: Spec) -> str:
    """Return the BibTeX entries of the library, of the paper and of BendFields."""
    release = spec.release
    fields = {"title": f"{{{_tex(spec.title)}}}"}
    if release is not None:
        fields |= {
            "author": " and ".join(map(_author, release.authors)),
            "year": release.date[:4],
            "version": _tex(release.version),
            "note": f"Version {_tex(release.version)} of {release.date}",
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
    return f"{{{_tex(name)}}}" if name.startswith("The ") else _tex(name)


def _tex(text: str) -> str:
    return "".join(_SPECIAL_OF_TEX.get(letter, letter) for letter in text)


@dataclass(frozen=True)
class Terms:
    """Licences in a library, for its texts."""

    sketches: tuple[Sketch, ...]

    @property
    def licence(self) -> str:
        """The known licence that all sketches share; empty without one."""
        stated = {each.origin.license for each in self.sketches}
        return next(iter(stated)) if len(stated) == 1 and stated <= {*LICENCES} else ""

    @property
    def name(self) -> str:
        """The full name of the licence of all sketches."""
        return LICENCES[self.licence][0]

    @property
    def known(self) -> list[tuple[str, str, str]]:
        """Identifier, name and address of each licence that is stated and known."""
        stated = dict.fromkeys(each.origin.license for each in self.sketches)
        return [(each, *LICENCES[each]) for each in stated if each in LICENCES]

    @property
    def lines(self) -> Iterator[str]:
        """One line per sketch with its stated origin."""
        for sketch in self.sketches:
            origin = sketch.origin
            licence = origin.license or "no licence is stated; ask its author before you share it"
            parts = (
                licence,
                origin.author and f"author: {origin.author}",
                origin.source and f"source: {origin.source}",
            )
            yield f"{sketch.name}: {'; '.join(filter(None, parts))}"
