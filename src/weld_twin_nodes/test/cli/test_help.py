# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Every command tells what it does and which options it takes."""

from __future__ import annotations

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
