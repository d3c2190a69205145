# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Do springs by measured efforts predict a real arm better than springs by the model's statics?

Leaves out stretches of time in turn, diagnoses the rest with and without efforts, and judges both on
the stretch, beside plain fits of frames and geometry: efforts.md. Beside it lies the diagnosis of all
stations with efforts, with its page, as weld-twin diagnose writes it.
"""

from __future__ import annotations

from weld_twin_nodes.cli.options import ROBOT, folder_output

from ...study import Study, options, study

PAGE = 'efforts.md'


OPTIONS = options(
    'TABLE  stations with measured poses and efforts',
    ROBOT,
    '--folds N  stretches [default: 5]',
    folder_output('where table and page go'),
    out='',
)


@study
def run(study: Study) -> None:
    """Judge every stretch, diagnose the whole, write table and page, print the table."""
    from weld_twin_core.diagnosis import diagnose
    from weld_twin_core.errors import ModelError
    from weld_twin_msgs_py.files.input_files import hashed
    from weld_twin_msgs_py.files.whole_files import write_text
    from weld_twin_msgs_py.tables import read_table
    from weld_twin_report.report.diagnosis_files import RESULT, write_results

    from ...real_arms.by_effort import folds, table
    from ...real_arms.unseen import ALIGN

    args = study.args
    if args.folds < 2:
        raise ModelError(f'--folds {args.folds}: give two stretches or more')
    robot = args.load_robot()
    recording = read_table(args.table, robot).recording
    with args.output(RESULT) as place:
        page = table(recording.name, folds(recording, robot, args.folds, study.tell))
        write_text(place / PAGE, page)
        whole = diagnose(recording, robot, align=ALIGN)
        write_results(place, whole, [hashed('recording', args.table)], args.find_urdf())
    print(page, end='')
