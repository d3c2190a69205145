# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The linters of ROS 2 over this package, where they are installed."""

from pathlib import Path

import pytest

PACKAGE = Path(__file__).parents[1]
ARGUED = ('D213', 'D400', 'D401', 'D417')
"""Rules that CONTRIBUTING argues."""


def test_every_file_names_its_copyright_and_licence(monkeypatch):
    main = pytest.importorskip('ament_copyright.main', reason='needs ament_copyright')
    monkeypatch.chdir(PACKAGE)
    assert main.main(argv=['.']) == 0


def test_flake8_finds_nothing(monkeypatch):
    main = pytest.importorskip('ament_flake8.main', reason='needs ament_flake8')
    monkeypatch.chdir(PACKAGE)
    code, found = main.main_with_errors(argv=['--config', 'setup.cfg', '.'])
    assert code == 0, '\n'.join(found)


def test_pep257_finds_nothing_but_what_is_argued(monkeypatch):
    main = pytest.importorskip('ament_pep257.main', reason='needs ament_pep257')
    monkeypatch.chdir(PACKAGE)
    assert main.main(['--add-ignore', *ARGUED, '--', '.']) == 0
