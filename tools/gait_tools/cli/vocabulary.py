# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""``gait_bank vocabulary``: learn the words of the paper's shape prior."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import numpy as np
from tqdm import tqdm

from gait_segmentation.files.output_files import keep_apart
from gait_segmentation.paper.vocabulary import FORMAT, VocabularyError
from gait_tools.cli.spec_options import add_spec_options, spec_of
from gait_tools.gait_model.builder import draw_views
from gait_tools.gait_model.silhouettes import read_masks
from gait_tools.outputs import is_own_picture, keep_others, write_picture
from gait_tools.vocabulary_training import (
    MODEL,
    Silhouette,
    VocabularySpec,
    bank_silhouettes,
    draw_vocabulary,
    learn_vocabulary,
    mask_silhouettes,
    write_vocabulary,
)

_TEXT = """\
The words are Gaussians over position and orientation of outline points, found
by K-means and then EM.  They split the outline of a template where
segmentation.prior is 'paper'; name the file in segmentation.vocabulary to use
it.  Learning needs scikit-learn: pip install scikit-learn

Without --from, the silhouettes are drawn from the package's gait model (576:
6 builds, 16 views, 6 phases).  With --from, they are the images in the folders,
laid out as for "gait_bank build --from" or in any other order and of any sizes:
grey values of 128 and more are the person, all of the body in view.  Images with
nobody, or somebody less than 16 pixels tall, are left out.  A few hundred of
varied people, views and phases are needed for words that fit everybody.

examples:
  gait_bank vocabulary words.json --picture words.png
  gait_bank vocabulary mine.json --from walk1 walk2 --words 12
"""
_SHOWN = 6


def add_parser(commands: Any) -> argparse.ArgumentParser:
    """Add the subcommand ``vocabulary``."""
    made: argparse.ArgumentParser = commands.add_parser(
        'vocabulary',
        help="learn the words of the paper's shape prior",
        description="Learn the vocabulary of the paper's oriented shape prior from silhouettes.",
        epilog=_TEXT,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    made.add_argument('output', help='the vocabulary file to write (.json)')
    made.add_argument(
        '--from', dest='folders', nargs='+', metavar='FOLDER', help='folders of silhouettes'
    )
    made.add_argument('--picture', metavar='FILE', help='write a picture of the words, too')
    add_spec_options(made, VocabularySpec, 'the words')
    return made


def run(options: argparse.Namespace) -> None:
    """Learn and write a vocabulary."""
    spec = VocabularySpec(**spec_of(options, VocabularySpec))
    output = Path(options.output)
    picture = Path(options.picture) if options.picture is not None else None
    outputs = [('the vocabulary', output), ('--picture', picture)]
    keep_apart(outputs, map(Path, options.folders or ()))
    kinds = [(*outputs[0], _are_words), (*outputs[1], is_own_picture)]
    keep_others(kinds, 'gait_bank vocabulary')
    for path in (output, picture or output):
        if not path.parent.is_dir():
            raise VocabularyError(f'cannot write {path}: {path.parent} is not a folder')
    with tqdm(unit='sequence', disable=None, leave=False) as bar:
        silhouettes, source = _silhouettes(options.folders, bar)
        bar.set_description(f'learning from {len(silhouettes)} silhouettes')
        vocabulary = learn_vocabulary(silhouettes, spec, source)
    write_vocabulary(vocabulary, output)
    if picture is not None:
        chosen = np.linspace(0, len(silhouettes) - 1, _SHOWN + 2).astype(int)[1:-1]
        words = draw_vocabulary(vocabulary, [silhouettes[k] for k in chosen])
        write_picture(picture, words, VocabularyError)
    about = vocabulary.provenance
    print(
        f'{output}: {vocabulary.words} words from {about["silhouettes"]} silhouettes '
        f'({about["outline points"]} outline points)'
    )


def _are_words(head: bytes) -> bool:
    return FORMAT.encode() in head


def _silhouettes(folders: list[str] | None, bar: tqdm[Any]) -> tuple[list[Silhouette], str]:
    """Return the silhouettes to learn from, and in words where they are from."""
    if folders is None:
        bar.reset(len(MODEL.build_names) * MODEL.azimuths)
        return list(bank_silhouettes(draw_views(MODEL, bar.update))), 'gait model'
    bar.reset(len(folders))
    found: list[Silhouette] = []
    for folder in folders:
        masks = [mask for _, mask in read_masks(folder)]
        try:
            found += mask_silhouettes(masks)
        except VocabularyError as error:
            raise VocabularyError(f'{folder}: {error}') from error
        bar.update()
    return found, 'folders ' + ', '.join(Path(folder).name for folder in folders)
