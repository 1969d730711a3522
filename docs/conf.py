"""How Sphinx builds these pages: offline, from Markdown, notebooks and docstrings."""

import sys
from pathlib import Path
from shutil import copyfile

import jupytext

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE))

from reference import (  # noqa: E402
    as_restructured_text,
    block_mathml,
    inline_mathml,
    not_ours,
    write_api_pages,
    write_command_page,
)

project = "muscle_bayes"
author = "The muscle_bayes authors"
extensions = ["myst_nb", "sphinx.ext.autodoc"]
exclude_patterns = ["reference.py"]

html_theme = "furo"
html_title = project
html_copy_source = False
html_show_sourcelink = False

myst_enable_extensions = ["colon_fence", "dollarmath"]
html_math_renderer = "mathml"  # the usual one fetches a script from elsewhere
myst_heading_anchors = 3
nb_execution_mode = "off"  # scripts/notebooks.py runs them
nb_merge_streams = True

autodoc_default_options = {"members": True, "ignore-module-all": True}
autodoc_member_order = "bysource"
autodoc_typehints = "signature"
autodoc_preserve_defaults = True
default_role = "code"
toc_object_entries_show_parents = "hide"
suppress_warnings = [
    "ref.python",  # classes of one name in several modules
    "toc.not_included",  # pages that `make real`, `trial`, `calibration` and `bench` write
]

write_api_pages(HERE / "api")
write_command_page(HERE / "commands.md")
for source in sorted((HERE.parent / "notebooks").glob("*.py")):
    shown = HERE / "notebooks" / f"{source.stem}.ipynb"
    shown.parent.mkdir(exist_ok=True)
    if (run := source.with_suffix(".ipynb")).exists():
        copyfile(run, shown)
    else:  # without figures, until `make notebooks` has run it
        notebook = jupytext.read(source)
        notebook.metadata.language_info = {"name": "python", "pygments_lexer": "ipython3"}
        jupytext.write(notebook, shown)


def setup(app):
    """Docstrings are plain text with Markdown's code marks, which autodoc takes for another markup."""
    app.connect("autodoc-process-docstring", as_restructured_text)
    app.connect("autodoc-skip-member", not_ours)
    app.add_html_math_renderer("mathml", (inline_mathml, None), (block_mathml, None))
