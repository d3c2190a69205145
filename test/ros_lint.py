# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What `test_lint.py` of every package asks: the linters of ROS 2 over it, where they are installed."""

import pytest

ARGUED = ('D213', 'D400', 'D401', 'D417')
"""Rules that CONTRIBUTING argues."""


@pytest.fixture(autouse=True)
def in_the_package(monkeypatch, request):
    monkeypatch.chdir(request.path.parents[1])


def test_every_file_names_its_copyright_and_licence():
    main = pytest.importorskip('ament_copyright.main', reason='needs ament_copyright')
    assert main.main(argv=['.']) == 0


def test_flake8_finds_nothing():
    main = pytest.importorskip('ament_flake8.main', reason='needs ament_flake8')
    code, found = main.main_with_errors(argv=['--config', 'setup.cfg', '.'])
    assert code == 0, '\n'.join(found)


def test_pep257_finds_nothing_but_what_is_argued():
    main = pytest.importorskip('ament_pep257.main', reason='needs ament_pep257')
    assert main.main(['--add-ignore', *ARGUED, '--', '.']) == 0
