# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The glossary explains every term on the page of a diagnosis."""

import re
import sys
from html import unescape
from pathlib import Path

import pytest

from weld_twin_nodes.wording.words import DEPENDENCES, PLACES, STATUS

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / 'docs/_ext'))

from range_rows import cause_rows, word_rows  # noqa: E402

CAUSES = '\n'.join(f'| {title} | {meaning} |' for title, meaning in (*cause_rows(), *word_rows()))
GLOSSARY = (ROOT / 'docs/glossary.md').read_text(encoding='utf-8') + '\n' + CAUSES
ORDINARY = (
    'a acceleration against all and apart are as at by can cannot cause controller data direction do '
    'does each effect enter far found from good how if in is it itself joint larger left lies looked '
    'made may measure much motion next of off on only other pass path position recording robot s '
    'speed spot take tell that the them then these this to ur use value we weld were what where which '
    'why with worst wrong'
)
"""Words that any reader has, in the questions and heads of the page."""


def rows(text):
    """Return the words of a glossary, lower case, without marks."""
    cells = re.findall(r'^\| ([^|]+) \| [^|]+ \|$', text, flags=re.MULTILINE)
    return {word.lower().strip('`') for cell in cells for word in (cell, *cell.split(', '))}


def labels(page):
    """Return what the page calls things: heads, keys and the heads of rows and columns."""
    body = re.sub(r'<(script|style|svg)\b.*?</\1>', '', page, flags=re.DOTALL)
    found = re.findall(r'<(h2|h3|th|dt|legend)\b[^>]*>(.*?)</\1>', body, flags=re.DOTALL)
    texts = (unescape(re.sub('<[^>]+>', ' ', text)) for _, text in found)
    return {re.sub(r'\s+', ' ', text).strip().lower() for text in texts}


def unexplained(label, words):
    """Return what is left of a label without joints, explained terms and ordinary words."""
    left = re.sub(r'\b\w*_\w+\b', '', label)
    for word in sorted(words, key=len, reverse=True):
        left = re.sub(rf'(?<!\w){re.escape(word)}s?(?!\w)', '', left)
    return [word for word in re.findall(r'[a-z]+', left) if word not in ORDINARY.split()]


@pytest.fixture(scope='module')
def page(elbow_found):
    return (elbow_found / 'report.html').read_text(encoding='utf-8')


def test_every_label_of_the_page_is_explained_and_alike_wherever_it_is(page):
    words = rows(GLOSSARY)
    left = {label: rest for label in labels(page) if (rest := unexplained(label, words))}
    assert left == {}
    folded = re.search(r'What the words on this page mean.*?</dl>', page, flags=re.DOTALL)[0]
    terms = {unescape(term).lower() for term in re.findall(r'<dt[^>]*>([^<]+)</dt>', folded)}
    assert terms and terms <= rows(GLOSSARY)


def test_every_cause_status_place_and_dependence_is_explained():
    words, text = rows(GLOSSARY), GLOSSARY.lower()
    assert all(len(meaning.split()) > 3 for _, meaning in cause_rows())
    assert set(STATUS) <= words
    assert all(place.removeprefix('the ') in text for place in PLACES.values())
    assert all(
        each.removeprefix('the ').partition(':')[0] in text for each in DEPENDENCES.values()
    )


def test_a_term_that_nobody_explains_is_seen():
    assert unexplained('eigenvalue of elbow_joint', rows(GLOSSARY)) == ['eigenvalue']
