# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
How Sphinx makes the documentation site; `make docs` runs it.

The source folder is the whole repository, so that a link between two files is the same link here
and on a forge: pages are in ``docs/``, notebooks in ``examples/``. Nothing is fetched from
anywhere, neither when the site is built nor when it is read.
"""

import sys
from pathlib import Path

from docutils import nodes
from sphinx import addnodes
from sphinx.application import Sphinx

import weld_twin_core as wt

sys.path.append(str(Path(__file__).parent / '_ext'))

project = 'weld_twin'
author = 'weld_twin contributors'
project_copyright = author
version = release = wt.__version__
root_doc = 'docs/index'
include_patterns = [
    'docs/*.md',
    'docs/reference/*.md',
    'docs/results/cells/cells.md',
    'docs/results/coverage/coverage.md',
    'docs/results/efforts/efforts.md',
    'docs/results/real_arms/*.md',
    'docs/results/gate/gate.md',
    'docs/results/history/*.md',
    'docs/results/sensitivity/README.md',
    'docs/results/transfer/after.md',
    'docs/results/transfer/before.md',
    'docs/results/waits/waits.md',
    'examples/*.ipynb',
    'bags/README.md',
    'CHANGELOG.md',
    'CONTRIBUTING.md',
    'src/*/README.md',
]

extensions = [
    'myst_nb',
    'sphinx.ext.autodoc',
    'sphinx.ext.napoleon',
    'sphinx.ext.viewcode',
    'sphinx_copybutton',
    'sphinx_design',
    'command_reference',
    'node_reference',
    'range_table',
]

# Pages ------------------------------------------------------------------------------------------
myst_enable_extensions = ['colon_fence', 'deflist']
myst_heading_anchors = 3
copybutton_exclude = '.linenos, .gp, .go'
nb_execution_mode = 'cache'
nb_execution_raise_on_error = True
nb_execution_timeout = 300
nb_merge_streams = True

# Docstrings -------------------------------------------------------------------------------------
default_role = 'py:obj'
autodoc_typehints = 'none'  # the docstrings say types with shapes and units
autodoc_member_order = 'bysource'
autodoc_default_options = {'members': True}
napoleon_google_docstring = False
napoleon_use_rtype = False
napoleon_use_ivar = True

# Looks ------------------------------------------------------------------------------------------
html_theme = 'pydata_sphinx_theme'
html_title = 'weld_twin'
html_static_path = ['_static']
html_css_files = ['site.css']
html_show_sourcelink = False
html_theme_options = {
    'navbar_align': 'left',
    'show_toc_level': 2,
    'navigation_with_keys': False,
    'show_prev_next': False,
    'footer_start': ['copyright'],
    'footer_end': [],
}

FRONT = """<!doctype html>
<meta charset="utf-8">
<title>weld_twin</title>
<meta http-equiv="refresh" content="0; url=docs/index.html">
<a href="docs/index.html">weld_twin</a>
"""


def write_front(app: Sphinx, failure: Exception | None) -> None:
    """Lead the top of the site to its first page, which lies in a folder like its source."""
    if failure is None:
        Path(app.outdir, 'index.html').write_text(FRONT, encoding='utf-8')


UNITS = frozenset({'m', 'mm', 's', 'ns', 'N', 'N m', 'rad', 'rad/s', 'm/s', 'kg', 'degC', 'K'})


def leave_units(app: Sphinx, page: nodes.document) -> None:
    """Keep the units in the types of arguments from becoming links to fields of that name."""
    for link in list(page.findall(addnodes.pending_xref)):
        if link['reftarget'] in UNITS:
            link.replace_self(link.children)


def keep_whole(
    app: Sphinx, what: str, name: str, item: object, options: object, lines: list[str]
) -> None:
    """Keep napoleon from taking the first words of a property's sentence for its type."""
    if what == 'property' and lines:
        lines[0] = lines[0].replace(': ', ' \N{EN DASH} ')


def setup(app: Sphinx) -> None:
    """Ask to be called in between and at the end."""
    app.connect('autodoc-process-docstring', keep_whole, priority=100)
    app.connect('doctree-read', leave_units)
    app.connect('build-finished', write_front)
