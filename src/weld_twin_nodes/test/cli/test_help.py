# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Every command tells what it does and which options it takes."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

from weld_twin_nodes.cli import main


def commands(text):
    """Return the names that a help text lists, those of its own subcommands."""
    _, _, rows = text.partition('COMMAND\n')
    return [row.split()[0] for row in rows.splitlines() if row[:4].isspace() and row[4:5].strip()]


def test_every_command_prints_its_help(capsys):
    with pytest.raises(SystemExit):
        main(['--help'])
    names = commands(capsys.readouterr().out)
    assert {'simulate', 'predict'} <= set(names)
    assert names[0] == 'diagnose'
    for name in names:
        with pytest.raises(SystemExit) as end:
            main([name, '--help'])
        assert end.value.code == 0
        assert f'usage: weld-twin {name}' in capsys.readouterr().out


@pytest.mark.parametrize(('given', 'threads'), [({}, '1'), ({'OPENBLAS_NUM_THREADS': '2'}, '2')])
def test_linear_algebra_stays_on_one_core_unless_told_otherwise(given, threads):
    program = (
        'import os, sys\n'
        'from weld_twin_nodes.cli.main import main\n'
        "sys.argv = ['weld-twin', 'schema', 'robot']\n"
        'main()\n'
        "print(os.environ['OPENBLAS_NUM_THREADS'])\n"
    )
    bare = {name: value for name, value in os.environ.items() if not name.endswith('NUM_THREADS')}
    run = subprocess.run(
        [sys.executable, '-c', program], env={**bare, **given}, capture_output=True, text=True
    )
    assert run.stdout.splitlines()[-1] == threads, run.stderr
