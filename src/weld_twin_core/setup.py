# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
from pathlib import Path

from setuptools import find_packages, setup

NAME = 'weld_twin_core'

setup(
    name=NAME,
    version='0.1.0',
    packages=find_packages(),
    package_data={NAME: ['py.typed', '**/*.yaml', '**/*.json']},
    data_files=[
        ('share/ament_index/resource_index/packages', ['resource/' + NAME]),
        ('share/' + NAME, ['package.xml']),
    ],
    install_requires=[
        'setuptools',
        'numpy>=1.25,<3',
        'scipy>=1.10,<2',
    ],
    extras_require={'test': ['pytest']},
    python_requires='>=3.10',
    zip_safe=False,
    maintainer='weld_twin contributors',
    maintainer_email='maintainers@example.org',
    description="A robot's positional accuracy as arrays: kinematics, effects, twin, diagnosis.",
    license='Apache-2.0',
    long_description=(Path(__file__).resolve().parent / 'README.md').read_text(encoding='utf-8'),
    long_description_content_type='text/markdown',
)
