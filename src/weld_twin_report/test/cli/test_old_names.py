# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The names that modules had in weld_twin_nodes go on for a release, and lead to the same modules."""

import subprocess
import sys
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path

import pytest

from weld_twin_nodes.cli.main import COMMANDS
from weld_twin_nodes.moved import MOVED


@pytest.mark.parametrize(('old', 'new'), list(MOVED.items()))
def test_an_old_name_is_the_module_of_the_new_one(old, new):
    sys.modules.pop(old, None)
    with pytest.warns(DeprecationWarning, match=f"'{old}' is '{new}' now"):
        assert import_module(old) is import_module(new)
    assert import_module(new).__name__ == new


def test_what_lies_in_a_package_that_moved_is_loaded_once():
    code = (
        'import sys, warnings\n'
        'warnings.simplefilter("ignore")\n'
        'from weld_twin_nodes.report.html import Html as old\n'
        'from weld_twin_nodes import report\n'
        'from weld_twin_report.report.html import Html as new\n'
        'assert old is new and report is sys.modules["weld_twin_report.report"]\n'
        'try: import weld_twin_nodes.report.nonsense\n'
        'except ModuleNotFoundError as error: print(error.name)\n'
    )
    done = subprocess.run([sys.executable, '-c', code], capture_output=True, text=True)
    assert done.stdout.split() == ['weld_twin_report.report.nonsense'], done.stderr


def test_the_command_line_names_what_this_package_brings():
    folder = Path(find_spec('weld_twin_report.cli.commands').origin).parent
    brought = {file.stem for file in folder.glob('[a-z]*')}
    assert brought == {name for name, place in COMMANDS.items() if 'report' in place}
