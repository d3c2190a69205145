# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
from pathlib import Path

from setuptools import find_packages, setup

NAME = 'weld_twin_report'

setup(
    name=NAME,
    version='0.1.0',
    packages=find_packages(),
    package_data={NAME: ['py.typed', '**/*.css', '**/*.js', '**/LICENSE']},
    data_files=[
        ('share/ament_index/resource_index/packages', ['resource/' + NAME]),
        ('share/' + NAME, ['package.xml']),
    ],
    install_requires=[
        'setuptools',
        'weld_twin_core>=0.1,<0.2',
        'weld_twin_msgs_py>=0.1,<0.2',
        'weld_twin_nodes>=0.1,<0.2',
        'numpy>=1.25,<3',
        'PyYAML>=6,<7',
        'rich>=13,<16',
        'matplotlib>=3.7,<4',
    ],
    extras_require={
        'history': ['sqlalchemy'],
        'postgresql': ['psycopg[binary]'],
        'serve': ['fastapi', 'starlette', 'uvicorn', 'h11', 'python-multipart', 'sqlalchemy'],
        'test': ['pytest'],
    },
    python_requires='>=3.10',
    zip_safe=False,
    maintainer='weld_twin contributors',
    maintainer_email='maintainers@example.org',
    description='Diagnoses as people read them: pages, history, fleet and server of the twin.',
    license='Apache-2.0',
    long_description=(Path(__file__).resolve().parent / 'README.md').read_text(encoding='utf-8'),
    long_description_content_type='text/markdown',
)
