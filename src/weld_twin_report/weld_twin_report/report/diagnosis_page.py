# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The sheet of a diagnosis: one HTML file that needs nothing else, and prints on a side or two."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from html import escape
from pathlib import Path

import yaml

from weld_twin_core.diagnosis.result import Diagnosis
from weld_twin_core.errors import ModelError
from weld_twin_core.metrics.conformity import Rule
from weld_twin_msgs_py.files.input_files import InputFile
from weld_twin_nodes.wording.quantities import counted

from .acceptance import judgement, largest, most_data, on_what, rule_data, rule_of
from .answer import Answer
from .charts import embedded
from .circle_plot import circle_data
from .controllers import brand_of
from .html import Html, document, joined, own_file, tag
from .opening import header, opening
from .page_data import left_out, page_data
from .sections import Content, Demand, drawn

_FOLDED = 'For engineers: what else it could be, and how far each effect shrinks it'
SCRIPTS = ('sheet.js', 'seam.js', 'polar.js')


@dataclass(frozen=True)
class Sheet:
    """What a reader wants of the sheet."""

    demand: Demand = field(default_factory=Demand)  # tolerance, and uncertainty of the instrument
    joints: Mapping[str, str] = field(default_factory=dict)
    """What joints are called on the controller; those not in it keep their name."""
    brand: str | None = None
    """Whose controller it is, as `controllers.BRANDS` has it; None and the robot's name tells."""


def report_page(
    diagnosis: Diagnosis, inputs: Sequence[InputFile] = (), sheet: Sheet | None = None
) -> str:
    sheet = sheet or Sheet()
    rule = rule_of(diagnosis, sheet.demand)
    brand = sheet.brand or brand_of(diagnosis.model.robot.name)
    answer = Answer(diagnosis, rule, brand)
    judged = _judged(diagnosis, rule) if answer.sound else None
    page = Content(answer, sheet.demand, inputs, judged)
    body = joined(
        [
            header(answer),
            opening(answer, judged),
            *(drawn('answer', page) if answer.sound else ()),
            *drawn('checks', page),
            tag('details.detail', tag('summary', _FOLDED), *drawn('engineers', page))
            if answer.sound
            else None,
            *drawn('print', page),
        ]
    )
    title = f'{answer.status} · {diagnosis.model.robot.name} · diagnosis'
    foot = tag('div.detail', *drawn('foot', page))
    main = tag('main', Html(renamed(body, sheet.joints)), foot)
    if not answer.sound:
        return document(title, main)
    data = {
        **page_data(diagnosis),
        'most': most_data(diagnosis),
        'rule': rule_data(rule),
        'circles': circle_data(diagnosis),
    }
    data_tag = Html(renamed(embedded(data, 'data'), sheet.joints))
    scripts = [tag('script', own_file(name)) for name in SCRIPTS]
    return document(title, main, data_tag, charts=True, scripts=scripts)


def _judged(diagnosis: Diagnosis, rule: Rule) -> Html | None:
    """Return the verdict on the tolerance; it stays hidden until one is given, here or there."""
    if diagnosis.contacts is not None or not diagnosis.traces.t:
        return None
    size = largest(diagnosis)
    verdict = rule.judged(size)
    where = f'as it is, {on_what(diagnosis)}'
    out, _ = left_out(diagnosis)
    if out:
        verb = 'is' if out == 1 else 'are'
        where += f'; {counted(out, "sample")} {verb} left out of it'
    return tag(
        'p',
        f'{judgement(rule, size)}, {where}',
        class_=f'status judged {verdict}',
        hidden='' if rule.tolerance_m is None else None,
        data_top=f'{1e3 * size:.9f}',
        data_where=where,
    )


_PREFIX = re.compile(r'[A-Za-z]{1,3}')


def joint_labels(given: str, joints: Sequence[str]) -> dict[str, str]:
    """
    Return what each joint is called on the page; empty for the names of the model.

    given: a prefix such as ``A`` or ``J``, which the number of the joint follows, or a YAML
    file that gives a name to joints: ``shoulder_pan_joint: A1``.
    """
    if not given:
        return {}
    if _PREFIX.fullmatch(given):
        return {name: f'{given}{k}' for k, name in enumerate(joints, 1)}
    path = Path(given)
    if not path.is_file():
        raise ModelError(
            f'--joint-names {given}: give a prefix of one to three letters such as A, or a YAML '
            'file with a line "joint: name" for each joint'
        )
    content = yaml.safe_load(path.read_text(encoding='utf-8'))
    if not isinstance(content, dict):
        raise ModelError(f'{given}: expected lines "joint: name", one for each joint')
    for name in content:
        if name not in joints:
            raise ModelError(
                f'{given}: the robot has no joint {name!r}; it has {", ".join(joints)}'
            )
    return {str(name): str(label) for name, label in content.items()}


def renamed(markup: str, labels: Mapping[str, str]) -> str:
    """Return markup in which joints have their labels; other words are left alone."""
    if not labels:
        return markup
    by_name = {escape(name): escape(label) for name, label in labels.items()}
    longest = sorted(by_name, key=len, reverse=True)
    pattern = re.compile(rf'(?<![\w/.-])({"|".join(map(re.escape, longest))})(?![\w/-])')
    return pattern.sub(lambda match: by_name[match[1]], markup)
