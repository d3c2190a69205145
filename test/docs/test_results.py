# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The results that are kept are small; of the others there is a command and a digest."""

import re
import shlex
from pathlib import Path

import pytest

from weld_twin_nodes.cli.main import parser_of, renamed

RESULTS = Path(__file__).parents[2] / 'docs/results'
LARGE, ALL = 100_000, 2_200_000
"""Bytes of the largest file that is kept, and of all, but for what is learned from."""
LEARNED = 'belief/cases.jsonl.gz'
"""The statements that the calibration is learned from; the only file that is larger."""
MADE = (RESULTS / 'SHA256SUMS').read_text(encoding='utf-8')


def test_what_is_kept_is_small():
    sizes = {
        str(file.relative_to(RESULTS)): file.stat().st_size
        for file in RESULTS.rglob('*')
        if file.is_file()
    }
    assert sizes.pop(LEARNED)
    assert [name for name, size in sizes.items() if size > LARGE] == []
    assert sum(sizes.values()) < ALL


def test_what_is_not_kept_has_a_digest_and_stands_below_its_command():
    blocks = MADE.strip().split('\n\n')[1:]
    for block in blocks:
        assert re.fullmatch(
            r'# weld-twin .+ --out OUT\n(# engine [0-9a-f]{64}\n)?([0-9a-f]{64}  \S+\n?)+', block
        ), block
        for name in re.findall(r'^[0-9a-f]{64}  (\S+)$', block, re.M):
            assert not (RESULTS / name).exists() and (RESULTS / name).parent.is_dir()


@pytest.mark.parametrize('command', sorted(set(re.findall(r'^# weld-twin (.+)$', MADE, re.M))))
def test_the_command_of_what_is_not_kept_can_be_typed(command):
    typed = renamed(shlex.split(command))
    assert parser_of(typed).parse_args(typed).out == 'OUT'
