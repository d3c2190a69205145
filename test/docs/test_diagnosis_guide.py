# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The guide's commands and code run as they stand, and its tables are complete."""

import re
import shlex
from pathlib import Path

import pytest

from weld_twin_nodes.cli import main
from weld_twin_nodes.offline.exports import FORMATS
from weld_twin_report.report.diagnosis_files import PAGE, RESULT

ROOT = Path(__file__).parents[2]
GUIDE = (ROOT / 'docs' / 'diagnosis.md').read_text(encoding='utf-8')


@pytest.fixture
def here(tmp_path, monkeypatch):
    (tmp_path / 'bags').symlink_to(ROOT / 'bags')
    monkeypatch.chdir(tmp_path)


def test_the_commands_run_one_after_the_other(here):
    commands = re.findall(r'^    weld-twin (.*)$', GUIDE, re.MULTILINE)
    assert len(commands) == 4
    for command in commands:
        assert main(shlex.split(command)) == 0, command


def test_the_code_runs(here, capsys):
    exec(re.search(r'```python\n(.*?)```', GUIDE, re.DOTALL)[1], {})
    assert "'status'" in capsys.readouterr().out


def test_every_file_is_told():
    for name in [PAGE, RESULT, *(name for name, _ in FORMATS.values())]:
        assert f'`{name}`' in GUIDE, name


def options_of(command, capsys):
    with pytest.raises(SystemExit):
        main([command, '--help-all'])
    return set(re.findall(r'--[a-z-]+', capsys.readouterr().out))


def test_every_option_is_told(capsys):
    own_page = options_of('import', capsys) - {'--camera', '--target', '--contacts'}
    for option in options_of('diagnose', capsys) - own_page:
        assert option in GUIDE, option
