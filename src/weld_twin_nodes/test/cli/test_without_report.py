# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A robot's computer has no weld_twin_report: nodes and the commands that write no page do without."""

import subprocess
import sys

import pytest

AS_IF_MISSING = 'import sys; sys.modules["weld_twin_report"] = None\n'
"""What a program begins with, so that the package is not found in it."""
PAGES = {'diagnose', 'investigate', 'serve', 'history', 'fleet', 'demo', 'verify', 'sensitivity'}


def python(code: str, *words: object) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, '-c', AS_IF_MISSING + code, *map(str, words)],
        capture_output=True,
        text=True,
    )


def test_every_module_of_the_nodes_is_imported_without_the_pages():
    pytest.importorskip('rclpy', reason='needs ROS 2')
    done = python(
        'from importlib import import_module\n'
        'from pkgutil import walk_packages\n'
        'import weld_twin_nodes\n'
        'found = walk_packages(weld_twin_nodes.__path__, "weld_twin_nodes.")\n'
        'names = [each.name for each in found if not each.name.endswith("__main__")]\n'
        'for name in names: import_module(name)\n'
        'web = {"fastapi", "starlette", "uvicorn", "sqlalchemy"} & set(sys.modules)\n'
        'print(len(names), *web)\n'
    )
    assert done.returncode == 0, done.stderr
    count, *web = done.stdout.split()
    assert int(count) > 70
    assert web == []


def test_the_command_line_has_the_other_commands_and_says_which_package_brings_these(tmp_path):
    done = python(
        'from weld_twin_nodes.cli.in_process import weld_twin\n'
        'names, bag, *words = sys.argv[1:]\n'
        'for each in (["--help"], ["simulate", *words, "--out", bag], ["bag", bag],\n'
        '    *([name] for name in names.split())):\n'
        '    said = weld_twin(*each)\n'
        '    print(said.code, said.out, said.err, "<end>")\n',
        *(' '.join(sorted(PAGES)), tmp_path / 'bag'),
        *('--robot', 'ur5', '--rate', 20, '--path', 'line'),
    )
    listed, made, shown, *missing = done.stdout.split('<end>\n')[:-1]
    assert [text[:2] for text in (listed, made, shown)] == ['0 '] * 3, done.stdout
    assert ' simulate ' in listed and ' bag ' in listed
    assert not {name for name in PAGES if f' {name} ' in listed}
    assert 'usable for a diagnosis' in shown
    for name, told in zip(sorted(PAGES), missing, strict=True):
        assert told.startswith('2 '), done.stderr
        assert f"'{name}' writes pages; it needs the package weld_twin_report" in told
