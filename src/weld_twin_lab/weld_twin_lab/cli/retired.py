# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Proofs that are no more, and where what they asked is answered now."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from typing import Any

from weld_twin_core.errors import ModelError

LAB = {
    'degenerate': "'lab campaign fuzz --recordings N' diagnoses recordings that hardly say anything",
    'pages': "'lab waits --only pages' times them",
    'shares': "'lab coverage --cases N' says how often intervals of shares hold",
    'users': 'tests of the server drop recordings beside hostile connections, and kill it',
    'beliefs': "'lab baseline --without NAME' counts what a mechanism of the diagnosis is worth",
    'plans': "'lab coverage --plans N' carries plans out",
    'contacts': "'lab real-arms' judges the three arms, 'lab coverage --touches N' arms of the plant",
    'fleet': 'a test compares the rows of a list whose run is killed with those of a whole one',
    'growth': "'lab waits' times a minute, ten minutes and an hour of motion, and 2,772 stations",
    'real-robots': "'lab transfer' judges both arms on stations never fitted",
}
BLIND = {
    'recovery': "'lab belief --cases N' diagnoses every family of effects at every size",
    'semi-real': "'lab real-arms' diagnoses real recordings",
}
CAMPAIGNS = {
    'demos': "'lab campaign soak' runs all nodes, and counts what each of them and the bag misses",
    'rates': "'lab campaign soak --rate 1000' counts what a bag misses at any rate",
}
OPTIONS = {
    'campaign kill --cases': 'tests kill commands at any change to files, a fleet run and a server',
    'campaign kill --each': 'tests kill commands at any change to files',
    'gate --real': "'lab real-arms' and 'lab transfer' diagnose poor parts of real recordings",
    'investigate --alone': "'lab investigate' never spends the minutes in other ways now",
}
"""Where the question of each is answered; they go with the next release."""


def add_retired(places: Any, retired: Mapping[str, str]) -> None:
    """
    Add names that the help does not list, and that answer with where to ask now.

    retired: by the name, where its question is answered.
    """
    for name, now in retired.items():
        parser = places.add_parser(name)
        parser.prefix_chars = '\n'  # no sign of an option: all that follows is words
        parser.add_argument('words', nargs='*')
        parser.set_defaults(retired=f"'{name}' is retired: {now}")


def add_retired_options(parser: Any, proof: str) -> None:
    """Let a proof take the options that it no longer has, to say where to ask now."""
    for words in OPTIONS:
        of, _, flag = words.rpartition(' ')
        if of == proof:
            parser.add_argument(flag, dest=words, nargs='*', help=argparse.SUPPRESS)


def refuse_retired(args: Any) -> None:
    """
    Refuse a proof that is no more, or an option.

    Raises ModelError: it is one; the message says where its question is answered.
    """
    if sentence := getattr(args, 'retired', ''):
        raise ModelError(sentence)
    for words, now in OPTIONS.items():
        if getattr(args, words, None) is not None:
            raise ModelError(f"'{words}' is retired: {now}")
