# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Install the package with pip or colcon."""

from glob import glob
from pathlib import Path

from setuptools import find_packages, setup

NAME = 'gait_segmentation'
# Resolved: colcon build --symlink-install runs a link to this file elsewhere.
HERE = Path(__file__).resolve().parent

# With an apt-installed Jazzy, rclpy and the messages come from apt; without one, these wheels
# are the same software.
ROS = [
    'ros-jazzy-rclpy',
    'ros-jazzy-common-interfaces',
    'ros-jazzy-rmw-fastrtps-cpp',
]
# Every lower bound is one that `make test-oldest` runs: see test/oldest.txt.
# What only commands need, and what reads bags; nodes run without, so package.xml does not name it.
TOOLS = [
    'lz4>=4.0.2',
    'rosbags>=0.11.0',
    'tqdm>=4.66.2',
]
# Networks run faster with it, and those of users only with it.
FAST = ['onnxruntime>=1.17.0']
# `gait_replay --jobs` and `--dask`.
ARCHIVE = ['distributed']
TEST = [
    'colcon-common-extensions',
    'distributed',
    'hypothesis',
    'mcap-ros2-support',
    'mypy',
    'onnx',
    'pytest',
    'pytest-cov',
    'pytest-xdist',
    'ros-jazzy-ament-package',
    'ruff',
]

setup(
    name=NAME,
    version='0.1.0',
    description='Live silhouettes of walking people, on a CPU',
    long_description=(HERE / 'README.md').read_text(encoding='utf-8'),
    long_description_content_type='text/markdown',
    author='The gait_segmentation contributors',
    license='GPL-3.0-or-later',
    keywords=['gait', 'segmentation', 'silhouette', 'tracking', 'pedestrian', 'ros2'],
    classifiers=[
        'Development Status :: 4 - Beta',
        'Intended Audience :: Science/Research',
        'Operating System :: POSIX :: Linux',
        'Programming Language :: Python :: 3',
        'Topic :: Scientific/Engineering :: Image Recognition',
        'Typing :: Typed',
    ],
    python_requires='>=3.10',
    packages=find_packages(include=[NAME, f'{NAME}.*']),
    package_data={
        NAME: ['py.typed'],
        f'{NAME}.detector': ['*.onnx.gz', '*.txt'],
        f'{NAME}.gait_model': ['*.npz'],
        f'{NAME}.paper': ['*.json'],
        f'{NAME}.starting': ['*.json'],
    },
    data_files=[
        ('share/ament_index/resource_index/packages', [f'resource/{NAME}']),
        (f'share/{NAME}', ['package.xml']),
        (f'share/{NAME}/config', sorted(glob('config/*'))),
        (f'share/{NAME}/launch', sorted(glob('launch/*.launch.py'))),
    ],
    install_requires=[
        'av>=12.0.0',
        'numba>=0.59.1',
        'numpy>=1.26.4',
        'opencv-python-headless>=4.6.0.66',
        'PyMaxflow>=1.3.0',
        'PyYAML>=6.0.1',
        'setuptools>=68.1.2',
    ],
    extras_require={
        'ros': ROS,
        'fast': FAST,
        'tools': TOOLS,
        'archive': [*TOOLS, *ARCHIVE],
        'test': [*TEST, *TOOLS, *FAST],
    },
    zip_safe=False,
    entry_points={
        'console_scripts': [
            'gait_localizer = gait_segmentation.nodes.localizer_node:main',
            'gait_matcher = gait_segmentation.nodes.matcher_node:main',
            'gait_pipeline = gait_segmentation.nodes.pipeline_node:main',
            'gait_replay = gait_segmentation.cli.replay:main',
            'gait_segmenter = gait_segmentation.nodes.segmenter_node:main',
            'gait_tracker = gait_segmentation.nodes.tracker_node:main',
            'gait_warm_up = gait_segmentation.cli.warm_up:main',
        ],
    },
)
