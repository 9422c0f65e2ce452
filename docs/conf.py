"""Settings of the pages: ``nox --session docs`` builds them from docs/, notebooks/ and the package.

The source folder is the top of the repository, so that links between the files are the same here
and where the files are read without a build.
"""

import re
import shutil
from pathlib import Path
from typing import Any

from docutils.nodes import SkipNode, document, inline, math, math_block, reference
from docutils.utils.math.latex2mathml import tex2mathml
from numpydoc.xref import DEFAULT_LINKS
from sphinx.application import Sphinx
from sphinx.writers.html5 import HTML5Translator

import memscal

project, author = "memscal", "memscal developers"
project_copyright = author
version = release = memscal.__version__

extensions = [
    "myst_nb",
    "numpydoc",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx_click",
    "sphinx_copybutton",
    "sphinx_design",
]
root_doc = "docs/index"
include_patterns = ["docs/**.md", "docs/api/*.rst", "notebooks/*.ipynb", "*.md"]
include_patterns += ["calibration_data/README.md"]
exclude_patterns = ["docs/templates"]
# Absolute, for autosummary looks for it from the source folder, and Sphinx from this one.
templates_path = [str(Path(__file__).with_name("templates"))]

# Notebooks are shown as they are stored: nox --session notebooks executes them.
nb_execution_mode = "off"
nb_output_stderr = "remove"
nb_render_markdown_format = "myst"  # tables among the outputs
myst_enable_extensions = ["amsmath", "colon_fence", "dollarmath"]
myst_heading_anchors = 4

autosummary_generate = True
autodoc_typehints = "none"  # the docstrings state the types, with units and shapes
autodoc_member_order = "bysource"
numpydoc_show_class_members = False  # autodoc shows the methods
numpydoc_xref_param_type = True
numpydoc_xref_ignore = "all"  # but our own names: the pages of Python and numpy are not at hand
numpydoc_xref_aliases = {word: word for word in DEFAULT_LINKS} | {
    name: f"memscal.{name}" for name in memscal.__all__ if name[0].isupper()
}

smartquotes = False  # what is copied from a page is what was written

html_theme = "pydata_sphinx_theme"
html_title = f"memscal {release}"
html_math_renderer = "mathml"  # browsers draw it themselves: no script, and nothing from outside
html_static_path = ["static"]
html_css_files = ["pages.css"]
html_js_files = [("pages.js", {"defer": "defer"})]
html_sidebars = {"**": ["all-pages"], "docs/index": []}  # the start page lists them itself
html_extra_path = ["static/index.html"]  # the top of the site leads to docs/index.html
html_copy_source = html_show_sourcelink = False
html_show_sphinx = False
html_context = {"default_mode": "auto"}
html_theme_options = {
    "logo": {"text": "memscal"},
    "navbar_align": "left",
    "navbar_center": [],
    "footer_start": ["copyright"],
    "footer_end": [],
    "show_toc_level": 2,
    "collapse_navigation": True,
    "navbar_persistent": ["search-button"],
    "secondary_sidebar_items": ["page-toc"],
    "pygments_light_style": "a11y-high-contrast-light",
    "pygments_dark_style": "a11y-high-contrast-dark",
}
copybutton_exclude = ".linenos, .gp, .go"


def show_as_typed(_: Sphinx, __: Any, lines: list[str]) -> None:
    """Show what the help of a command indents, its examples, as a block that can be copied."""
    shown: list[str] = []
    for number, line in enumerate(lines):
        if not line.startswith("|   "):
            shown.append(line)
            continue
        if not lines[number - 1].startswith("|   "):
            heading = shown.pop().removeprefix("| ")
            shown += [heading, "", ".. code-block:: text", ""]
        goes_on = lines[number + 1].startswith("|       ")
        shown.append(f"   {line[4:]} \\" if goes_on else f"   {line[4:]}")
    lines[:] = shown


def add_titles(app: Sphinx, doctree: document, _: str) -> None:
    """Name a page by its title where the text of a link is the name of its file."""
    for link in doctree.findall(reference):
        page = re.fullmatch(r"(?:docs/)?(\w+)\.md", link.astext())
        title = page and app.env.titles.get(f"docs/{page[1]}")
        if title:
            link.children = [inline("", title.astext())]


def mathml(node: math | math_block, display: str) -> str:
    """MathML of an equation; the number that it states as a tag stands beside it."""
    source, _, rest = node.astext().partition(r"\tag{")
    number = f'<span class="eqno">({rest.partition("}")[0]})</span>' if rest else ""
    return f"{number}{tex2mathml(source, as_block=display == 'block')}"


def inline_math(self: HTML5Translator, node: math) -> None:
    """Write an equation in a line of text."""
    self.body.append(mathml(node, "inline"))
    raise SkipNode


def block_math(self: HTML5Translator, node: math_block) -> None:
    """Write an equation on lines of its own."""
    self.body.append(f'<div class="math" tabindex="0">{mathml(node, "block")}</div>')
    raise SkipNode


def copy_schemas(app: Sphinx, _: Exception | None) -> None:
    """Put the JSON Schemas of the commands beside the pages, as the package ships them."""
    schemas = Path(memscal.__file__).with_name("cli") / "schemas"
    shutil.copytree(schemas, Path(app.outdir) / "schemas", dirs_exist_ok=True)


def setup(app: Sphinx) -> None:
    """Connect what stands above."""
    app.connect("build-finished", copy_schemas)
    app.connect("sphinx-click-process-epilog", show_as_typed)
    app.connect("doctree-resolved", add_titles)
    app.add_html_math_renderer("mathml", (inline_math, None), (block_math, None))
