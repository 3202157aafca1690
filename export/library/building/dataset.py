"""Croissant metadata of the table of entries, for tools of machine learning."""

from __future__ import annotations

import hashlib
from typing import Any, Final

from ..documents.citation import LICENCES, citation_of
from ..documents.documents import document_bytes
from ..plan.spec import Spec
from .table import COLUMNS, TABLE

CROISSANT: Final = "croissant.json"
_TERMS: Final = (
    "citeAs", "column", "equivalentProperty", "extract", "field", "fileProperty", "fileObject", "fileSet",
    "format", "includes", "isLiveDataset", "jsonPath", "key", "md5", "parentField", "path", "recordSet",
    "references", "regex", "repeated", "replace", "samplingRate", "separator", "source", "subField",
    "transform",
)  # fmt: skip
_CONTEXT: Final = {
    "@language": "en",
    "@vocab": "https://schema.org/",
    "conformsTo": "dct:conformsTo",
    "cr": "http://mlcommons.org/croissant/",
    "data": {"@id": "cr:data", "@type": "@json"},
    "dataType": {"@id": "cr:dataType", "@type": "@vocab"},
    "dct": "http://purl.org/dc/terms/",
    "examples": {"@id": "cr:examples", "@type": "@json"},
    "rai": "http://mlcommons.org/croissant/RAI/",
    "sc": "https://schema.org/",
    **{term: f"cr:{term}" for term in _TERMS},
}
"""Context of Croissant 1.1, as its specification recommends."""
_ABOUT: Final = (
    "Optimization problems that extrapolate curvature lines of sketches to cross fields: features, labels "
    "and split of each problem. The other files of the folder contain the problems."
)
_TYPES: Final = {str: "sc:Text", int: "sc:Integer", float: "sc:Float", bool: "sc:Boolean"}


def croissant(spec: Spec, rows: bytes) -> bytes:
    """Return Croissant 1.1 metadata of a library. rows: content of its table."""
    release = spec.release
    stated: dict[str, Any] = {"license": _licences(spec)}
    if release is not None:
        stated |= {
            "creator": [{"@type": "sc:Organization", "name": name} for name in release.authors],
            "datePublished": release.date,
            "version": release.version,
        }
    return document_bytes(
        {
            "@context": _CONTEXT,
            "@type": "sc:Dataset",
            "name": spec.title,
            "description": _ABOUT,
            "conformsTo": "http://mlcommons.org/croissant/1.1",
            "citeAs": citation_of(spec),
            **{key: value for key, value in stated.items() if value},
            "distribution": [
                {
                    "@type": "cr:FileObject",
                    "@id": TABLE,
                    "name": TABLE,
                    "contentUrl": TABLE,
                    "contentSize": f"{len(rows)} B",
                    "encodingFormat": "text/csv",
                    "sha256": hashlib.sha256(rows).hexdigest(),
                }
            ],
            "recordSet": [
                {
                    "@type": "cr:RecordSet",
                    "@id": "entries",
                    "name": "entries",
                    "description": "One record per entry: an instance in one formulation.",
                    "key": {"@id": "entries/name"},
                    "field": list(map(_croissant_field, COLUMNS)),
                }
            ],
        }
    )


def _croissant_field(name: str) -> dict[str, Any]:
    return {
        "@type": "cr:Field",
        "@id": f"entries/{name}",
        "name": name,
        "description": COLUMNS[name].meaning,
        "dataType": _TYPES[COLUMNS[name].kind],
        "source": {"fileObject": {"@id": TABLE}, "extract": {"column": name}},
    }


def _licences(spec: Spec) -> list[str]:
    """The licences of all sketches: the address where it is known, else the identifier."""
    stated = dict.fromkeys(sketch.origin.license for sketch in spec.sketches if sketch.origin.license)
    return [
        f"https://spdx.org/licenses/{licence}.html" if licence in LICENCES else licence for licence in stated
    ]
