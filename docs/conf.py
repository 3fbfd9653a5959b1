"""Settings of the documentation site.

``sphinx-build -W --keep-going -b html docs OUT`` builds it without a network.
"""

from __future__ import annotations

project = "hli-cosim"
author = "The hli-cosim authors"
copyright = "2026, the hli-cosim authors"

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinxcontrib.mermaid",
]
source_suffix = {".md": "markdown", ".rst": "restructuredtext"}
exclude_patterns = ["_build"]
nitpicky = False
suppress_warnings: list[str] = []

# A heading has the anchor that GitHub gives it; ```mermaid is a drawing, as there.
myst_heading_anchors = 4
myst_fence_as_directive = ["mermaid"]
myst_enable_extensions = ["colon_fence"]
# The drawings stay text in the page.  The reader's browser draws them, so no build needs a network.
mermaid_output_format = "raw"

# The programs' language has no lexer; a box without a language is text.
highlight_language = "text"

autodoc_member_order = "bysource"
autodoc_typehints = "description"
autodoc_typehints_description_target = "documented"
autosummary_generate = False

html_theme = "furo"
html_title = "hli-cosim"
html_copy_source = False
