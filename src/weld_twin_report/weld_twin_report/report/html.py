# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Markup from values: whatever is not markup already is escaped."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cache
from html import escape
from importlib.resources import files
from typing import Any, NamedTuple

from weld_twin_nodes.wording.words import capital

_EMPTY = frozenset({'br', 'meta', 'input'})


class Html(str):
    """Text that is markup already."""

    __slots__ = ()


Child = str | None


def tag(kind: str, *children: Child, **attributes: str | float | None) -> Html:
    """
    Return an element, such as ``tag('p#own.note', text, data_run=1)``: its name, id and classes.

    Attribute names take ``_`` for ``-``, and a trailing one keeps a name off Python's keywords;
    attributes and children that are None are left out.
    """
    name, *classes = kind.split('.')
    name, _, id_ = name.partition('#')
    parts = [f'<{name}']
    attributes = {'id': id_ or None, 'class': ' '.join(classes) or None, **attributes}
    for key, value in attributes.items():
        if value is not None:
            parts.append(f' {key.rstrip("_").replace("_", "-")}="{escape(str(value))}"')
    if name in _EMPTY:
        return Html(''.join(parts) + '>')
    inside = joined(children)
    return Html(f'{"".join(parts)}>{inside}</{name}>')


def joined(children: Iterable[Child]) -> Html:
    """Return children side by side."""
    return Html(
        ''.join(
            child if isinstance(child, Html) else escape(str(child))
            for child in children
            if child is not None
        )
    )


def section(title: str, *children: Child, id_: str, lead: str | None = None) -> Html:
    """Return a section with its heading and a sentence that says how to read it."""
    opening = tag('p.lead', lead) if lead else None
    return tag('section', tag('h2', title), opening, *children, id_=id_)


def table(heads: Iterable[str], rows: Iterable[Iterable[Child]], class_: str = '') -> Html:
    """Return a table; the first cell of a row is its heading."""
    body = []
    for row in rows:
        first, *rest = row
        body.append(tag('tr', tag('th', first, scope='row'), *(tag('td', cell) for cell in rest)))
    top = tag('tr', *(tag('th', head, scope='col') for head in heads))
    whole = tag('table', tag('thead', top), tag('tbody', *body), class_=class_ or None)
    # A table that is wider than a phone scrolls, also by the keyboard.
    return tag('div.scroll', whole, tabindex='0')


def columns(
    items: Iterable[Any], shown: Mapping[str, Callable[[Any], Child]], class_: str = ''
) -> Html:
    """Return a table with a row for each item: what every column shows of it stands by its head."""
    return table(shown, ([show(item) for show in shown.values()] for item in items), class_)


class Bar(NamedTuple):
    """A horizontal bar: its label, its length as a share of the full width, and a text."""

    label: str
    share: float
    text: str
    kind: str = ''  # class of its row
    fallen: float | None = None  # length that is drawn behind it as what has gone


def bars(rows: Iterable[tuple[str, float, str] | Bar], class_: str = '') -> Html:
    """Return horizontal bars, a row each."""
    out = []
    for label, share, text, kind, fallen in (Bar(*row) for row in rows):
        gone = None if fallen is None else tag('i.fallen', style=_width(fallen))
        track = tag('span.track', tag('i', style=_width(share)), gone)
        parts = (tag('span.label', label), track, tag('span.figure', text))
        out.append(tag('li', *parts, class_=kind or None))
    return tag('ul', *out, class_=f'bars {class_}'.strip())


def _width(share: float) -> str:
    return f'width:{100.0 * min(max(share, 0.0), 1.0):.2f}%'


Figure = tuple[str, Child, Child]
"""What is asked, the answer, and what stands behind it."""


def figures(cells: Iterable[Figure]) -> Html:
    """Return the few large figures at the top of a page."""
    figures = [
        tag('div', tag('dt', name), tag('dd', value), tag('dd.note', note))
        for name, value, note in cells
    ]
    return tag('dl.figures', *figures)


def pairs(rows: Iterable[tuple[str, Child]]) -> Html:
    """Return heads and what belongs to each; what is empty is left out."""
    parts = [part for head, text in rows if text for part in (tag('dt', head), tag('dd', text))]
    return tag('dl.pairs', *parts)


def sentences(texts: Iterable[Child]) -> Html:
    """Return sentences below each other as a list."""
    return tag('ul.sentences', *(tag('li', text) for text in texts))


def said_section(title: str, texts: Sequence[str], id_: str) -> Html | None:
    """Return a section of sentences, which texts become; None without any."""
    said = sentences(f'{capital(text)}.' for text in texts)
    return section(title, said, id_=id_) if texts else None


def lines(texts: Iterable[Child]) -> Html | None:
    """Return texts below each other in a cell; None without any."""
    spans = [tag('span', text) for text in texts]
    return tag('span.lines', *spans) if spans else None


def main(
    kind: tuple[str, str], subject: str, headline: str, cells: Html, *sections: Child
) -> Html:
    """Return the frame of a page: what kind, of what, its headline and figures, and its sections."""
    bold = tag('b', kind[1]) if kind[1] else None
    head = tag('header', tag('p.kind', kind[0], bold), tag('p.subject', subject))
    return tag('main', head, tag('section#verdict', tag('h1', headline), cells), *sections)


POLICY = "default-src 'none'; style-src 'unsafe-inline'"
"""What a page may load: nothing but its own style; a page that needs more says so."""

OWN_SCRIPTS = "script-src 'unsafe-inline'"
"""What a page with scripts of its own may run besides: what stands in the page, nothing fetched."""


@cache
def own_file(name: str) -> Html:
    """Return a style or script that lies beside this module."""
    return Html((files(__package__) / name).read_text(encoding='utf-8'))


def document(
    title: str,
    *body: Child,  # what stands in the body
    # What the page may load besides its own style, in the words of a content security policy.
    allowed: str = '',
    style: str = '',  # CSS after that of all pages
    # Whether figures of `charts` stand on it; what draws them is then embedded.
    charts: bool = False,
    scripts: Sequence[Html] = (),  # script elements of the page's own, after those of the charts
) -> str:
    """Return a whole page that needs no other file and no network."""
    if charts:
        allowed = '; '.join(filter(None, [allowed, OWN_SCRIPTS]))
        style = own_file('uplot/uPlot.min.css') + own_file('charts.css') + style
        body += tuple(
            tag('script', own_file(name)) for name in ('uplot/uPlot.iife.min.js', 'charts.js')
        )
    body += tuple(scripts)
    policy = '; '.join(filter(None, [POLICY, allowed]))
    head = joined(
        [
            tag('meta', charset='utf-8'),
            tag('meta', http_equiv='Content-Security-Policy', content=policy),
            tag('meta', name_='viewport', content='width=device-width, initial-scale=1'),
            tag('meta', name_='color-scheme', content='light dark'),
            tag('title', title),
            tag('style', Html(own_file('page.css') + style)),
        ]
    )
    whole = tag('html', tag('head', head), tag('body', *body), lang='en')
    return f'<!doctype html>\n{whole}\n'
