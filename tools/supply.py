# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What weld_twin is made of.

    tools/in_env python tools/supply.py lock        writes tools/lock.txt anew: every package that `make`
                                                    installs, with hashes; fetches uv where it is missing
    tools/in_env python tools/supply.py sbom        prints a CycloneDX bill of what is installed
    tools/in_env python tools/supply.py licences    prints the licences of it, as a table

`tools/setup` installs from the lock where it fits, and by the ranges of pyproject.toml elsewhere.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
import venv
from collections.abc import Iterator
from importlib import metadata
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parent.parent
LOCK = ROOT / 'tools/lock.txt'
GROUPS = {
    'run': ('ros',),
    **{
        name: (name,)
        for name in ('test', 'bench', 'docs', 'serve', 'history', 'postgresql', 'mocap')
    },
}
"""What `tools/setup` is asked for, and the extras it means; 'run' is what `make demo` needs."""
OLDEST = '3.10'
"""The lowest Python that the lock is for."""
PYTHONS = re.compile(r'-((py2\.)?py3|(py|cp)31[0-4])-(none|abi3|cp31[0-4])-|-cp3\d-abi3-')
"""Wheels for the Pythons that are supported, from 3.10 to 3.14."""
PLATFORMS = re.compile(r'(any|manylinux\w*(\.manylinux\w*)*_x86_64)\.whl$')
"""Wheels for the platform that ROS 2 is on PyPI for; elsewhere the lock is not used."""
SENTENCES = {
    'MIT': 'Permission is hereby granted, free of charge',
    'Apache-2.0': 'Apache License Version 2.0',
    'BSD': 'Redistributions of source code must retain',
    'Qhull': 'Qhull, Copyright',
}
"""Licences by a sentence that stands in their text, for packages whose metadata name none."""
_HEAD = f"""\
# What `make` installs, with SHA-256, for Linux on x86_64 with Python {OLDEST} to 3.14.
# Made by `python tools/supply.py lock`. Above each package stands what it is needed for.
"""


def uv(place: Path) -> str:
    """Return the program uv: the one on the path, or one of its own in a folder."""
    found = shutil.which('uv')
    if found:
        return found
    venv.create(place / 'uv', with_pip=True)
    python = place / 'uv/bin/python'
    subprocess.run([python, '-m', 'pip', 'install', '--quiet', 'uv>=0.8,<1'], check=True)
    return str(place / 'uv/bin/uv')


def resolved(
    program: str, place: Path, extras: tuple[str, ...], *more: str
) -> list[dict[str, Any]]:
    """Return the packages that extras need on any Python and platform, as pylock.toml has them."""
    import tomllib  # with Python 3.11; only the lock needs it

    out = place / 'pylock.toml'
    words = [program, 'pip', 'compile', '--quiet', '--universal', '--python-version', OLDEST]
    words += [word for extra in extras for word in ('--extra', extra)]
    words += ['--format', 'pylock.toml', '--output-file', str(out), *more]
    out.unlink(missing_ok=True)
    environment = {**os.environ, 'UV_PYTHON_DOWNLOADS': 'never'}
    subprocess.run(
        [*words, 'pyproject.toml', 'hatchling.in'], cwd=place, env=environment, check=True
    )
    packages: list[dict[str, Any]] = tomllib.loads(out.read_text(encoding='utf-8'))['packages']
    return packages


def lock() -> None:
    """Write the lock anew."""
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        shutil.copy(ROOT / 'pyproject.toml', place)
        shutil.copy(ROOT / 'README.md', place)
        version = 'src/weld_twin_core/weld_twin_core/__init__.py'
        (place / version).parent.mkdir(parents=True)
        shutil.copy(ROOT / version, place / version)
        # The package itself is built with what the lock has, not with whatever is newest.
        (place / 'hatchling.in').write_text(re.search(r'"(hatchling.*?)"', toml())[1] + '\n')
        program = uv(place)
        every = tuple(extra for extras in GROUPS.values() for extra in extras)
        packages = resolved(program, place, every)
        pins = place / 'pins.txt'
        pins.write_text(''.join(f'{requirement(package)}\n' for package in packages))
        needed: dict[tuple[str, str], list[str]] = {}
        for group, extras in GROUPS.items():
            for package in resolved(program, place, extras, '--constraint', str(pins)):
                needed.setdefault(named(package), []).append(group)
    blocks = [_HEAD]
    for package in packages:
        hashes = sorted(hashes_of(package))
        groups = needed.get(named(package))
        if not hashes or not groups:
            continue  # nothing of it is for this platform
        # What is needed to run is needed always.
        told = ['run'] if 'run' in groups else groups
        lines = [requirement(package), *(f'--hash=sha256:{value}' for value in hashes)]
        blocks.append(f'# {" ".join(told)}\n' + ' \\\n    '.join(lines) + '\n')
    LOCK.write_text('\n'.join(blocks), encoding='utf-8')
    print(f'{LOCK.relative_to(ROOT)}: {len(blocks) - 1} packages')


def toml() -> str:
    """Return the text of pyproject.toml."""
    return (ROOT / 'pyproject.toml').read_text(encoding='utf-8')


def named(package: dict[str, Any]) -> tuple[str, str]:
    """Return name and version of a package."""
    return package['name'], package['version']


def requirement(package: dict[str, Any]) -> str:
    """Return a package as a requirement, with the Pythons and platforms that it is for."""
    marker = package.get('marker')
    return f'{package["name"]}=={package["version"]}' + (f' ; {marker}' if marker else '')


def hashes_of(package: dict[str, Any]) -> Iterator[str]:
    """Yield the hashes of a package's wheels that fit; where none does, of its source."""
    fit = [
        wheel['hashes']['sha256']
        for wheel in package.get('wheels', [])
        for name in [wheel.get('name') or wheel['url'].rsplit('/', 1)[-1]]
        if PYTHONS.search(name) and PLATFORMS.search(name)
    ]
    yield from fit
    if not fit and 'sdist' in package:
        yield package['sdist']['hashes']['sha256']


def installed() -> list[tuple[str, str, str]]:
    """Return name, version and licence of every package that is installed, in order."""
    found = {
        each.metadata['Name'].lower().replace('_', '-'): (each.version, licence(each))
        for each in metadata.distributions()
        if each.metadata['Name']
    }
    return [(name, *found[name]) for name in sorted(found)]


def licence(package: metadata.Distribution) -> str:
    """Return the licence of a package: as its metadata, its package.xml or its licence file say."""
    told = package.metadata
    if told.get('License-Expression'):
        return str(told['License-Expression'])
    classifiers = [
        text.rsplit(' :: ', 1)[-1]
        for text in told.get_all('Classifier') or []
        if text.startswith('License :: ') and text != 'License :: OSI Approved'
    ]
    first = (told.get('License') or '').strip().split('\n')[0][:60]
    return ' or '.join(classifiers) or first or of_ros(package) or of_file(package) or 'not told'


def of_ros(package: metadata.Distribution) -> str:
    """Return the licences that the package.xml of a ROS package names."""
    name = re.sub('^ros-(jazzy-)?', '', package.metadata['Name'].replace('_', '-'))
    path = Path(sys.prefix) / 'share' / name.replace('-', '_') / 'package.xml'
    text = path.read_text(encoding='utf-8') if path.is_file() else ''
    return ' and '.join(re.findall(r'<license[^>]*>\s*(.*?)\s*</license>', text))


def of_file(package: metadata.Distribution) -> str:
    """Return the licence whose sentence stands in a package's licence file."""
    for file in package.files or []:
        if re.search('licen[cs]e|copying', file.name, re.IGNORECASE):
            text = ' '.join(Path(str(file.locate())).read_text(encoding='utf-8').split())
            return next((name for name, words in SENTENCES.items() if words in text), '')
    return ''


def sbom() -> None:
    """Print a bill of materials in CycloneDX 1.6."""
    components = [
        {
            'type': 'library',
            'name': name,
            'version': version,
            'purl': f'pkg:pypi/{name}@{version}',
            'licenses': [{'license': {'name': told}}],
        }
        for name, version, told in installed()
    ]
    bill = {
        'bomFormat': 'CycloneDX',
        'specVersion': '1.6',
        'version': 1,
        'metadata': {'component': {'type': 'application', 'name': 'weld-twin'}},
        'components': components,
    }
    print(json.dumps(bill, indent=1))


def licences() -> None:
    """Print the licences as a table."""
    print('| package | version | licence |\n|---|---|---|')
    for row in installed():
        print(f'| {" | ".join(cell.replace("|", "/") for cell in row)} |')


def main() -> int:
    """Run what is asked for."""
    jobs = {'lock': lock, 'sbom': sbom, 'licences': licences}
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument('what', choices=jobs)
    jobs[parser.parse_args().what]()
    return 0


if __name__ == '__main__':
    sys.exit(main())
