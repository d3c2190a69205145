# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What is installed: the lock, the bill of materials, and a wheel that is the same every time."""

import hashlib
import json
import os
import re
import shutil
import subprocess
import sys
from importlib import metadata
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

if sys.version_info >= (3, 11):
    import tomllib
else:
    tomllib = pytest.importorskip('tomli')

ROOT = Path(__file__).parents[2]
PROJECT = tomllib.loads((ROOT / 'pyproject.toml').read_text())['project']
BLOCK = re.compile(r'# ([a-z ]+)\n([^\n]+?) \\\n((?: +--hash=sha256:[0-9a-f]{64}(?: \\)?\n)+)')
INSTALLED = ('ros', 'test', 'bench', 'docs', 'serve', 'history', 'postgresql', 'mocap')
"""Extras that `make` installs, or that the README tells to install with tools/setup."""
HOLES = {'starlette': '0.49.0', 'h11': '0.14.0', 'python-multipart': '0.0.17'}
"""Versions with holes that were published."""


def locked():
    """Return groups and requirement of every block of the lock."""
    text = (ROOT / 'tools/lock.txt').read_text()
    return [(match[1].split(), Requirement(match[2])) for match in BLOCK.finditer(text)]


def test_every_line_of_the_lock_is_a_pin_with_hashes_and_names_no_host():
    text = (ROOT / 'tools/lock.txt').read_text()
    assert '://' not in text and '--index' not in text
    left = BLOCK.sub('', text)
    assert [line for line in left.splitlines() if line and not line.startswith('# ')] == []
    for _, pin in locked():
        assert [each.operator for each in pin.specifier] == ['==']


@pytest.mark.parametrize('python', ['3.10', '3.11', '3.12', '3.13'])
def test_the_lock_has_every_dependency_in_a_version_that_is_asked_for(python):
    where = {'python_version': python, 'python_full_version': f'{python}.4', 'extra': ''}
    pins = {}
    for groups, pin in locked():
        if pin.marker is None or pin.marker.evaluate(where):
            (version,) = pin.specifier
            for group in groups:
                assert (group, canonicalize_name(pin.name)) not in pins
                pins[group, canonicalize_name(pin.name)] = version.version
    wanted = [('run', text) for text in PROJECT['dependencies']]
    extras = PROJECT['optional-dependencies']
    wanted += [(extra, text) for extra in INSTALLED for text in extras[extra]]
    for group, text in wanted:
        asked, name = Requirement(text), canonicalize_name(Requirement(text).name)
        if asked.marker is None or asked.marker.evaluate(where):
            version = pins.get(('run', name)) or pins.get((group, name))
            assert version, f'{text} of {group} is not in the lock: tools/supply.py lock'
            assert asked.specifier.contains(version, prereleases=True), text


def test_what_the_packages_of_the_lock_need_themselves_is_in_the_lock():
    pins = {canonicalize_name(pin.name): pin for _, pin in locked()}
    lacking = []
    for package in metadata.distributions():
        name = canonicalize_name(package.metadata['Name'])
        if name in pins and pins[name].specifier.contains(package.version):
            needs = [Requirement(text) for text in package.requires or []]
            lacking += [
                f'{name}: {need}'
                for need in needs
                if (need.marker is None or need.marker.evaluate({'extra': ''}))
                and canonicalize_name(need.name) not in pins
            ]
    assert lacking == []


def test_versions_with_known_holes_are_not_asked_for():
    for extra in ('serve', 'test'):
        asked = {
            Requirement(t).name: Requirement(t) for t in PROJECT['optional-dependencies'][extra]
        }
        for name, version in HOLES.items():
            assert not asked[name].specifier.contains(version)


def test_the_bill_of_materials_names_what_is_installed_with_its_licence():
    done = [
        subprocess.run(
            [sys.executable, str(ROOT / 'tools/supply.py'), what],
            capture_output=True, text=True, check=True,
        ).stdout
        for what in ('sbom', 'licences')
    ]  # fmt: skip
    bill = json.loads(done[0])
    assert (bill['bomFormat'], bill['specVersion']) == ('CycloneDX', '1.6')
    found = {each['name']: each for each in bill['components']}
    assert 'BSD' in found['numpy']['licenses'][0]['license']['name']
    assert found['numpy']['purl'] == f'pkg:pypi/numpy@{found["numpy"]["version"]}'
    assert f'| numpy | {found["numpy"]["version"]} |' in done[1]
    rows = [line for line in done[1].splitlines() if line.endswith('| not told |')]
    assert len(rows) <= 1, rows  # urdf-parser-py says it nowhere


def test_two_builds_of_the_wheel_are_the_same(tmp_path):
    pytest.importorskip('hatchling', reason='the builder is not installed')
    copy = tmp_path / 'copy'
    shutil.copytree(ROOT / 'src', copy / 'src', ignore=shutil.ignore_patterns('__pycache__'))
    for name in ('pyproject.toml', 'README.md', 'LICENSE', '.gitignore'):
        shutil.copy(ROOT / name, copy)
    for path in copy.rglob('*'):
        os.utime(path, (1_000_000_000, 1_000_000_000))
        path.chmod(0o700 if path.is_dir() else 0o600)
    hashes = []
    for source in (ROOT, copy):
        out = tmp_path / f'wheel_{len(hashes)}'
        subprocess.run(
            [sys.executable, '-m', 'hatchling', 'build', '-t', 'wheel', '-d', str(out)],
            cwd=source, check=True, capture_output=True,
        )  # fmt: skip
        (wheel,) = out.iterdir()
        hashes.append((wheel.name, hashlib.sha256(wheel.read_bytes()).hexdigest()))
    assert hashes[0] == hashes[1]
