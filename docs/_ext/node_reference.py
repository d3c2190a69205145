# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""``{weld-twin-nodes}`` and ``{weld-twin-topics}``: parameters of the nodes, and the topics."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import chain
from xml.etree import ElementTree

from docutils import nodes
from docutils.parsers.rst import Directive
from page_table import page_table
from sphinx.application import Sphinx

from weld_twin_msgs_py.messages.topics import TOPICS, VOLATILE, Qos
from weld_twin_nodes.live.cell_node import CellNode
from weld_twin_nodes.live.compensator import Compensator
from weld_twin_nodes.live.contact_marker import ContactMarker
from weld_twin_nodes.live.deviation_analyzer import DeviationAnalyzer
from weld_twin_nodes.live.deviation_markers import DeviationMarkers
from weld_twin_nodes.live.error_injector import ErrorInjector
from weld_twin_nodes.live.forward_kinematics_twin import ForwardKinematicsTwin
from weld_twin_nodes.live.live_diagnosis import LiveDiagnosis
from weld_twin_nodes.live.policy import policy
from weld_twin_nodes.live.recorder import Recorder
from weld_twin_nodes.live.settings import SHARED, Setting
from weld_twin_nodes.live.trajectory_generator import TrajectoryGenerator

NODES: dict[str, type[CellNode]] = {
    'trajectory_generator': TrajectoryGenerator,
    'error_injector': ErrorInjector,
    'forward_kinematics_twin': ForwardKinematicsTwin,
    'deviation_analyzer': DeviationAnalyzer,
    'deviation_markers': DeviationMarkers,
    'contact_marker': ContactMarker,
    'compensator': Compensator,
    'live_diagnosis': LiveDiagnosis,
    'recorder': Recorder,
}

WORDS = {
    ('topics', 'publish'): 'publishes',
    ('topics', 'subscribe'): 'hears',
    ('services', 'reply'): 'answers',
    ('services', 'request'): 'asks',
    ('actions', 'execute'): 'offers the action',
    ('actions', 'call'): 'sends goals to',
}
"""What the permissions of a policy are called on the page."""


class Nodes(Directive):
    """One section for every node, with its parameters."""

    def run(self) -> list[nodes.Node]:
        """Return the sections."""
        profiles = ElementTree.fromstring(policy()).iter('profile')
        allowed = {str(one.get('node')): dict(_permissions(one)) for one in profiles}
        # What every node may, whatever it is for, is on no node's list.
        common = set.intersection(*(set(chain(*own.values())) for own in allowed.values()))
        out = []
        for name, node in NODES.items():
            spoken = {
                words: [n for n in allowed[name].get(words, []) if n not in common]
                for words in WORDS.values()
            }
            out.append(_section(name, node.__doc__ or '', node.settings, spoken))
        return [*out, _section('Every node', 'Parameters that all of them have.', SHARED)]


class Topics(Directive):
    """The table of topics."""

    def run(self) -> list[nodes.Node]:
        """Return the table."""
        rows = [
            (t.name, t.meaning, t.type.replace('/msg', ''), _quality(t.requested)) for t in TOPICS
        ]
        return [page_table(('topic', 'meaning', 'type', 'requested as'), rows, 'sentences')]


def _quality(qos: Qos) -> str:
    latched = '' if qos.durability == VOLATILE else ', for latecomers too'
    return f'{qos.reliability.replace("_", " ")}, last {qos.depth}{latched}'


def _permissions(profile: ElementTree.Element) -> Iterator[tuple[str, list[str]]]:
    for group in profile:
        for verb in group.attrib:
            yield WORDS[group.tag, verb], [str(name.text) for name in group]


def _section(
    name: str,
    text: str,
    settings: tuple[Setting, ...],
    spoken: dict[str, list[str]] | None = None,
) -> nodes.section:
    section = nodes.section(ids=[f'node-{name.replace(" ", "-").lower()}'], names=[name])
    section += nodes.title(text=name)
    section += nodes.paragraph(text=text.strip().partition('\n\n')[0])
    for words, names in (spoken or {}).items():
        if names:
            section += nodes.paragraph(text=f'{words}: {", ".join(names)}')
    section += page_table(
        ('parameter', 'meaning', 'default', 'range', 'while running'),
        [
            (
                s.name,
                s.description,
                repr(s.default),
                '' if s.low is None else f'{s.low:g} to {s.high:g}',
                'may change' if s.live else '',
            )
            for s in settings
        ],
        'sentences',
    )
    return section


def setup(app: Sphinx) -> dict[str, bool]:
    """Add the directives."""
    app.add_directive('weld-twin-nodes', Nodes)
    app.add_directive('weld-twin-topics', Topics)
    return {'parallel_read_safe': True}
