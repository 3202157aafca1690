"""Configuration of the documentation site, which `sphinx-build -W docs site` builds."""

from __future__ import annotations

import sys
from importlib.metadata import version as installed
from pathlib import Path
from typing import TYPE_CHECKING, Any

from docutils.nodes import SkipNode, section

if TYPE_CHECKING:
    from sphinx.application import Sphinx

sys.path.insert(0, str(Path(__file__).parent))  # for the modules beside this file

from formulas import mathml, model_table

project = "crossfield"
author = "The crossfield authors"
version = release = installed("crossfield")
extensions = ["myst_nb", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "command_pages", "csv_pages"]
exclude_patterns = ["static"]
source_suffix = {".md": "myst-nb"}

myst_enable_extensions = ["dollarmath", "colon_fence", "deflist"]
myst_heading_anchors = 4

nb_execution_raise_on_error = True
nb_execution_in_temp = True
nb_execution_timeout = 300

default_role = "code"
html_theme = "furo"
html_title = f"crossfield {version}"
html_math_renderer = "mathml"
html_copy_source = False
html_show_copyright = False
html_static_path = ["static"]
html_theme_options = {"navigation_with_keys": True}

autodoc_typehints = "none"
autodoc_member_order = "bysource"
napoleon_numpy_docstring = True
napoleon_google_docstring = False
napoleon_use_rtype = False


def _inline(writer: Any, node: Any) -> None:
    """Write a formula within a line."""
    writer.body.append(mathml(node.astext()).replace(' displaystyle="true"', ""))
    raise SkipNode


def _block(writer: Any, node: Any) -> None:
    """Write a formula on lines of its own, and a model as a table."""
    source = node.astext().strip()
    if source.startswith(r"\begin{aligned}"):
        parent = node.parent
        while not isinstance(parent, section):
            parent = parent.parent
        writer.body.append(model_table(parent[0].astext(), source))
    else:
        writer.body.append(f'<div class="math">{mathml(source)}</div>')
    raise SkipNode


def setup(app: Sphinx) -> None:
    """Show formulas as MathML, for which browsers need no script, and small pictures enlarged."""
    app.add_html_math_renderer("mathml", (_inline, None), (_block, None))
    app.add_css_file("formulas.css")
    app.add_css_file("gallery.css")
