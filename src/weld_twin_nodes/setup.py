# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
from glob import glob
from pathlib import Path

from setuptools import find_packages, setup

NAME = 'weld_twin_nodes'

setup(
    name=NAME,
    version='0.1.0',
    packages=find_packages(),
    package_data={NAME: ['py.typed', '**/*.yaml', '**/*.xml']},
    data_files=[
        ('share/ament_index/resource_index/packages', ['resource/' + NAME]),
        ('share/' + NAME, ['package.xml']),
        ('share/' + NAME + '/launch', glob('launch/*.launch.py')),
        ('share/' + NAME + '/config', glob('config/*')),
        ('share/' + NAME + '/security', glob('security/*.xml')),
    ],
    install_requires=[
        'setuptools',
        'weld_twin_core>=0.1,<0.2',
        'weld_twin_msgs_py>=0.1,<0.2',
        'numpy>=1.25,<3',
        'scipy>=1.10,<2',
        'PyYAML>=6,<7',
        'rosbags>=0.11,<0.12',
        'rich>=13,<16',
        'matplotlib>=3.7,<4',
    ],
    extras_require={'cluster': ['distributed'], 'test': ['pytest']},
    python_requires='>=3.10',
    zip_safe=False,
    maintainer='weld_twin contributors',
    maintainer_email='maintainers@example.org',
    description='Nodes and command line of the welding robot digital twin.',
    license='Apache-2.0',
    long_description=(Path(__file__).resolve().parent / 'README.md').read_text(encoding='utf-8'),
    long_description_content_type='text/markdown',
    entry_points={
        'console_scripts': [
            'weld-twin = weld_twin_nodes.cli:main',
            'trajectory_generator = weld_twin_nodes.live.trajectory_generator:main',
            'error_injector = weld_twin_nodes.live.error_injector:main',
            'forward_kinematics_twin = weld_twin_nodes.live.forward_kinematics_twin:main',
            'deviation_analyzer = weld_twin_nodes.live.deviation_analyzer:main',
            'recorder = weld_twin_nodes.live.recorder:main',
            'live_diagnosis = weld_twin_nodes.live.live_diagnosis:main',
            'deviation_markers = weld_twin_nodes.live.deviation_markers:main',
            'contact_marker = weld_twin_nodes.live.contact_marker:main',
            'compensator = weld_twin_nodes.live.compensator:main',
        ]
    },
)
