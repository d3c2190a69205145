# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
from pathlib import Path

from setuptools import find_packages, setup

NAME = 'weld_twin_msgs_py'

setup(
    name=NAME,
    version='0.1.0',
    packages=find_packages(),
    package_data={NAME: ['py.typed']},
    data_files=[
        ('share/ament_index/resource_index/packages', ['resource/' + NAME]),
        ('share/' + NAME, ['package.xml']),
    ],
    # rosbags, mcap and lz4 have no ROS package; on ROS machines pip adds them beside the rest
    install_requires=[
        'setuptools',
        'weld_twin_core>=0.1,<0.2',
        'numpy>=1.25,<3',
        'scipy>=1.10,<2',
        'PyYAML>=6,<7',
        'defusedxml>=0.7.1,<0.8',
        'urdf-parser-py>=0.0.4,<0.1',
        'rosbags>=0.11,<0.12',
        'mcap>=1.1,<2',
        'lz4>=4,<5',
    ],
    extras_require={'test': ['pytest']},
    python_requires='>=3.10',
    zip_safe=False,
    maintainer='weld_twin contributors',
    maintainer_email='maintainers@example.org',
    description='Messages, bags, robot files and tables in and out of arrays.',
    license='Apache-2.0',
    long_description=(Path(__file__).resolve().parent / 'README.md').read_text(encoding='utf-8'),
    long_description_content_type='text/markdown',
    entry_points={
        'ament_copyright.license': [
            'apache2_short = weld_twin_msgs_py.files.short_licence:APACHE_2'
        ],
    },
)
