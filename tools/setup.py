# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Install the tools with pip, after the package itself."""

from setuptools import find_packages, setup

NAME = 'gait_tools'

setup(
    name=NAME,
    version='0.1.0',
    description='Demonstration, template banks and evaluation for gait_segmentation',
    author='The gait_segmentation contributors',
    license='GPL-3.0-or-later',
    python_requires='>=3.10',
    packages=find_packages(include=[NAME, f'{NAME}.*']),
    package_data={NAME: ['py.typed'], f'{NAME}.gait_model': ['*.json']},
    # The lower bounds are those of test/oldest.txt.
    install_requires=[
        'gait_segmentation==0.1.0',
        'matplotlib>=3.6.3',
        'pillow>=10.2.0',
        'tqdm>=4.66.2',
    ],
    extras_require={
        # `gait_evaluate` leaves MOTA and IDF1 out without it.
        'evaluate': ['motmetrics>=1.4.0'],
        # Only `gait_bank vocabulary` needs it; the learnt words are shipped.
        'learn': ['scikit-learn>=1.4.1.post1'],
    },
    zip_safe=False,
    entry_points={
        'console_scripts': [
            'gait_bank = gait_tools.cli.bank:main',
            'gait_demo = gait_tools.cli.demo:main',
            'gait_evaluate = gait_tools.cli.evaluate:main',
            'gait_figures = gait_tools.cli.figures:main',
        ],
    },
)
