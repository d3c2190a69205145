# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Three arms without an instrument: a ball in two sockets, judged on places left out.

Published postures of two Panda and one iiwa 14. Each place is left out in turn, and each place
alone is fitted and judged on the others. Writes contacts.json, contacts.md and a file per split; a
run that was interrupted goes on where it stopped.
"""

from __future__ import annotations

import json
from pathlib import Path

from ...study import REQUIRED, Study, listed, option, options, study

add_arguments = options(
    option('--data', REQUIRED, 'DIR', 'holds panda_1, kuka_14, ...'),
    option('--arms', '', 'A,B', 'panda_1, panda_2, kuka_14; all when left out'),
    option('--sealed', 0, 'N', 'also make and open N cases of the plant'),
    option(
        '--postures', 0, 'N', 'also ask on N arms of the plant how many postures a place needs'
    ),
)


@study
def run(study: Study) -> None:
    """Judge every split and print the table."""
    from weld_twin_core.errors import DataError

    from ...contacts.data import ARMS
    from ...contacts.splits import entries_of
    from ...contacts.table import summary, table

    args = study.args
    arms = listed(args.arms) or list(ARMS)
    for name in arms:
        if name not in ARMS:
            raise DataError(f'--arms: there is no arm {name!r}; they are {", ".join(ARMS)}')
    entries = entries_of(Path(args.data), arms, study.parts('splits'))
    study.write('contacts', summary(entries), table(entries))
    if args.sealed:
        from ...contacts.sealed import sealed

        score = sealed(args.sealed, study.parts('sealed'))
        study.write('sealed', score)
        print(', '.join(f'{key} {value}' for key, value in score.items()))
    if args.postures:
        from ...contacts.postures import postures

        needed = postures(args.postures, study.parts('postures'))
        study.write('postures', needed)
        print(json.dumps(needed))
