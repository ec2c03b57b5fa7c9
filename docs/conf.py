# ruff: noqa: E402 - the paths come first
"""Configuration of the documentation site; ``python docs/make_site.py`` builds all of it."""

from __future__ import annotations

import shutil
import sys
from importlib.util import find_spec
from pathlib import Path

from sphinx.application import Sphinx

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "docs")]

import from_code

import lean_yaw_env
from lean_yaw_env.viewer import write_page

project = "lean_yaw_env"
author = copyright = "The lean_yaw_env developers"
version = release = lean_yaw_env.__version__

extensions = [
    "myst_nb",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx_copybutton",
    "sphinx_design",
]
exclude_patterns = ["build", "_cache", "jupyter_execute"]
highlight_language = "none"
python_maximum_signature_line_length = 88

myst_enable_extensions = ["colon_fence", "deflist", "dollarmath", "substitution"]
myst_heading_anchors = 4
myst_substitutions = {"version": version}

nb_execution_mode = "cache"
nb_execution_cache_path = str(ROOT / "docs" / "_cache" / "notebooks")
nb_execution_timeout = 120
nb_execution_raise_on_error = True
nb_merge_streams = True

autodoc_default_options = {"members": True, "member-order": "bysource"}
autodoc_typehints_format = "short"
autodoc_type_aliases = {name: name for name in ("ArrayLike", "Vector", "Foot", "NDArray")}
napoleon_numpy_docstring, napoleon_google_docstring = True, False

# Formulas without a network: of the package with MathJax only what draws them is copied
MATHJAX = Path(find_spec("sphinx-mathjax-offline").origin).parent / "static" / "mathjax"
mathjax_path = "mathjax/tex-chtml-full.js"

html_theme = "furo"
html_title = "lean_yaw_env"
html_static_path = ["static"]
html_css_files = ["site.css"]
html_favicon = "static/walker.svg"
html_theme_options = {
    "light_css_variables": {"color-brand-primary": "#256eb2", "color-brand-content": "#256eb2"},
    "dark_css_variables": {"color-brand-primary": "#7db4e6", "color-brand-content": "#7db4e6"},
}

suppress_warnings = [
    "ref.python"
]  # words of type descriptions, such as "names", that are also attributes

linkcheck_ignore = [r"https://doi\.org/.*"]  # publishers refuse programs


def _fill(app: Sphinx, name: str, source: list[str]) -> None:
    source[0] = from_code.filled(source[0])


def _skip_fields(
    app: Sphinx, what: str, name: str, value: object, skip: bool, options: object
) -> bool | None:
    """Fields of named tuples, whose docstrings only say their number."""
    return True if (value.__doc__ or "").startswith("Alias for field number") else None


def _plain(
    app: Sphinx, what: str, name: str, value: object, options: object, lines: list[str]
) -> None:
    """Docstrings as napoleon takes them: it would read "a: b" in an attribute's first line as a type, and knows no tables of Markdown."""
    if what in ("attribute", "property"):
        lines.insert(0, "")
    lines[:] = from_code.without_markdown(lines)


def _copy(app: Sphinx, error: Exception | None) -> None:
    """Put the live page and MathJax beside the site."""
    if error is None and app.builder.name == "html":
        write_page(Path(app.outdir) / "live")
        out = Path(app.outdir)
        shutil.copytree(
            MATHJAX / "output" / "chtml" / "fonts" / "woff-v2",
            out / "_static" / "mathjax" / "output" / "chtml" / "fonts" / "woff-v2",
            dirs_exist_ok=True,
        )
        shutil.copy(MATHJAX / "tex-chtml-full.js", out / "_static" / mathjax_path)


def setup(app: Sphinx) -> None:
    """Fill marked places from the code, and complete the built site."""
    app.connect("source-read", _fill)
    app.connect("autodoc-skip-member", _skip_fields)
    app.connect("autodoc-process-docstring", _plain, priority=400)
    app.connect("build-finished", _copy)
