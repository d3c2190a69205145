# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Robot programs: are they read as they are meant, and does a corrected one help?

In every language drawn programs are read again by the product and by an independent reader, and programs
are broken at random (programs.json, programs.md). Seams of arms with sealed causes are recorded,
diagnosed, corrected as programs and driven by the plant (corrections.json, corrections.md). Arms given
as URDFs are planned, simulated, measured, diagnosed and corrected (urdf_arms.json, urdf_arms.md). With
--seams 0, --urdf-arms 0, or --drawn 0 and --broken 0, one part is left out. A run that was interrupted
goes on where it stopped. Exits with 1 when a program is read wrongly, or a broken one not met with
words.
"""

from __future__ import annotations

from pathlib import Path

from ...study import Study, option, options, study

add_arguments = options(
    option('--drawn', 200, 'N', 'programs a language'),
    option('--broken', 2000, 'N', 'broken programs a language'),
    option(
        '--seams',
        1,
        'N',
        'sealed seams a language that the plant runs before and after (default: 1)',
    ),
    option('--urdf-arms', 0, 'N', 'arms given as URDFs that go all the way (default: 0)'),
    option('--seed', 1, 'N', 'decides the seams'),
    option('--made', 'test/programs/made', 'DIR', 'programs as users have them'),
    pool=True,
)


@study
def run(study: Study) -> bool:
    """Try what is not tried yet, and print the tables."""
    from ...blind.diagnosing import engine_digest
    from ...programs import correction_table, urdf_table
    from ...programs.study import PARTS, head_of, seams, urdf_arms

    args, engine = study.args, engine_digest()
    right = _read(study) if args.drawn or args.broken else True
    for name, tasks, table in (
        ('corrections', seams(args.seed, args.seams, engine), correction_table),
        ('urdf_arms', urdf_arms(args.seed, args.urdf_arms, engine), urdf_table),
    ):
        if tasks:
            cases = study.tasks(tasks, name, study.out / PARTS)
            result = head_of(args.seed, engine, table.totals(cases), cases)
            study.write(name, result, table.page(result))
    return right


def _read(study: Study) -> bool:
    """Read what is drawn and what is broken, and return whether all went well."""
    from ...programs.study import PARTS, read, summary

    args = study.args
    result = read(args.drawn, args.broken, Path(args.made), study.parts(PARTS))
    study.write('programs', result, summary(result))
    wrong = [line for part in ('round_trips', 'fuzz') for e in result[part] for line in e['wrong']]
    for line in wrong:
        study.tell(line)
    return not wrong
