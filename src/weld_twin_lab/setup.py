# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
from pathlib import Path

from setuptools import find_packages, setup

NAME = 'weld_twin_lab'

setup(
    name=NAME,
    version='0.1.0',
    packages=find_packages(),
    package_data={NAME: ['py.typed']},
    data_files=[
        ('share/ament_index/resource_index/packages', ['resource/' + NAME]),
        ('share/' + NAME, ['package.xml']),
    ],
    install_requires=[
        'setuptools',
        'weld_twin_core>=0.1,<0.2',
        'weld_twin_msgs_py>=0.1,<0.2',
        'weld_twin_nodes>=0.1,<0.2',
        'weld_twin_report>=0.1,<0.2',
        'numpy>=1.25,<3',
        'scipy>=1.10,<2',
        'PyYAML>=6,<7',
        'lz4>=4,<5',
        'rich>=13,<16',
    ],
    extras_require={'test': ['pytest']},
    python_requires='>=3.10',
    zip_safe=False,
    maintainer='weld_twin contributors',
    maintainer_email='maintainers@example.org',
    description='Proof of the welding robot digital twin: blind check, plant, benchmarks, campaigns.',
    license='Apache-2.0',
    long_description=(Path(__file__).resolve().parent / 'README.md').read_text(encoding='utf-8'),
    long_description_content_type='text/markdown',
)
