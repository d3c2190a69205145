# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Commands that write pages; `weld_twin_nodes.cli.commands` says what a row and a module here have."""

from weld_twin_nodes.cli import options
from weld_twin_nodes.cli.parsing import Command

BRANDS = ('abb', 'fanuc', 'kuka', 'ur', 'yaskawa')
"""Makers whose controllers the page knows; the page has their names."""
OF_PLAN = """
plan the first measurement:
--tolerance MM           of the tool, such as 0.3; asks for a plan
--minutes MIN            there is time for
--postures N             so many, in place of as many as are needed
--noise MM               standard deviation of a measured coordinate: about 0.03 with a tracker or a
                         measuring arm, 0.1 with cameras, 0.1 to 0.2 with a pin (default: 0.03)
--model FILE             diagnosis.json: plan what to measure on top of it
--region REGION          where the tool is to be sure, with --model: a program, a bag, or a box
                         X,Y,Z:X,Y,Z (corners in the base frame, mm); the whole reach if left out
rare:
--seconds S              that one station takes, the way to it apart (default: 10)
--spread DEG             every joint turns so far to either side of a usual posture (default: 75)
--out FOLDER             where the plan goes, instead of DIR
"""
OF_PROGRAM = """
of a program:
--controller L           language, where the file does not tell it
--max-correction LENGTH ANGLE  how far a point may be moved (default: 2mm 1deg)
--tolerance LENGTH       of the tool, such as 0.3mm: also say how probably it is kept all along the
                         seams
--start A,A,...          joints before the first move, in degrees (mm for sliding ones)
--temperature DEGC       of the arm when the program runs
rare:
--noise LENGTH           of a coordinate of your instrument, for what to measure more (default:
                         0.03mm)
"""
_DIAGNOSE = Command(
    """Say where the gap lies, what causes it, how far it shrinks.

    Writes diagnosis.json, a page to read (report.html) and the corrected model to the directory. Ends
    with 3 where data or set-up are wrong (units, joints swapped, another robot): page and
    diagnosis.json then say what, and no model is written.
    """,
    'weld-twin diagnose my_bag --robot ur5 --align base,tool --out found',
    (
        'BAG ...                  bags or tables of one robot',
        options.ROBOT,
        options.folder_output('directory for the results'),
        f"""
how it was measured:
--holdout BAG            a recording that is not fitted; the shrink is judged on it; may be given again
{options.ALIGN}
--may-change NAMES       errors that may differ between the recordings, such as
                         joint_offset,tool_pose,base_pose
--apply                  if data or set-up are wrong and one correction explains it, make it and go on
rare:
--changed BAG WHAT       what was changed in the cell for one of the bags: load=KG hung from the tool
                         point (load=KG,X,Y,Z: there in the tool frame [m]; below 0: taken off),
                         another tool, or the instrument moved; may be given again
--instrument NAME        what measured: at960, at930, at901, at500, gts3800, or its largest permissible
                         error in mm, such as 0.015+0.006/m; @3 behind it: 3 m away
--contacts ARTEFACT.yaml  describes what the contacts of the bags touched, where they were not imported
                         with it
what is known of the causes:
--effects-known FILE     effects file or diagnosis.json; the twin has these effects from the start
--exclude-effect NAME ...  effects that cannot be the cause
what the page shows:
--tolerance MM           largest deviation allowed; the page says by ISO 14253-1 whether the robot
                         passes
--pdf                    print the page to report.pdf, to sign; needs Chromium
rare:
--uncertainty MM         standard uncertainty of a measured position, from the certificate of the
                         instrument
--joint-names A|J|FILE   what joints are called: a prefix (A1, A2, ...), or a YAML file of lines
                         "joint: name"
--region REGION          say how sure the corrected robot is there: a program, a bag, or a box
                         X,Y,Z:X,Y,Z (corners in the base frame, mm)
--controller {{{','.join(BRANDS)}}}  whose controller it is, if the name of the robot does not tell
the next experiment:
rare:
--experiment-minutes MIN  that it may take, with what has to be set up (default: 60)
--confirm                where the question is closed, but some joints did not move widely, plan one in
                         which they do
--cell-box NUMBERS       x,y,z of the lower and of the upper corner [m], in the measuring frame: the arm
                         stays between them
""",
        options.TOPICS,
        options.RARE_TABLE,
    ),
)
_INVESTIGATE = Command(
    """Diagnose, say what to measure next, until it is decided.

    Before anything is measured, --tolerance plans how many postures and which; DIR gets them with a
    table to fill in. With --model it plans on top of a diagnosis. Begin with DIR, recordings, --robot
    and --budget. Record the experiment that it asks for (experiment.yaml), and go on with DIR and the
    new bag. DIR alone tells where it stands. It ends when the cause is sure, when the budget is spent,
    or when nothing would part what is left, and says which.
    """,
    'weld-twin investigate cell7 bags/elbow_play --robot ur5 --budget 45',
    (
        """
[DIR]                    the investigation
[BAG ...]                recordings to begin or go on with
""",
        options.ANY_ROBOT,
        """
--budget MIN             minutes of experiments (default: 60)
--align FRAMES           as for diagnose
--controller L           write what is to be measured as a program too, as export program does
--changed WHAT           what was changed in the cell for the new bags, where it was not what was
                         asked: load=KG, tool, instrument, or nothing
--live                   run and record experiments in the cell that is up, until something has to be
                         changed
rare:
--effects-known FILE     as for diagnose
--cell-box NUMBERS       as for diagnose
--playback X             with --live: speed against real time [default: 1]
""",
        options.FORCE,
        OF_PLAN,
        options.TRIGGER,
        options.PROGRAM,
    ),
)
_CORRECT = Command(
    """Correct a robot program, or the joint commands of a bag.

    A PROGRAM is read in the language of its maker; the same program with other coordinates, a page
    (report.html) and correction.json go to the directory. Without --model it comes back as it was. Of a
    BAG with nominal joint commands, a bag is written with those that put the real tool on the seam.
    """,
    'weld-twin correct seam.script --robot ur5 --model found/diagnosis.json --out better',
    (
        'PROGRAM|BAG  program (a .dat is found beside it), or a bag with the nominal joint commands',
        options.ROBOT,
        '--model FILE             diagnosis.json, or an effects file',
        options.folder_output('directory of results; of a bag, the bag to write'),
        'rare:\n--setup N                which recording of the diagnosis [default: 1]',
        OF_PROGRAM,
        options.PROGRAM,
        options.STORAGE,
        options.TOPICS,
    ),
)
_VERIFY = Command(
    """Was the promise of a correction kept? Measured again.

    Says also which cause did not go away. With --program, the folder that correct wrote, the tool is
    held against where the program meant it. Without, the robot itself was mended (zeros mastered,
    constants entered, a gear serviced), and is held against its nominal model. Ends with 0 where the
    promise was kept, with 4 where it was not.
    """,
    'weld-twin verify after_bag --model found/diagnosis.json --program better',
    (
        """
AFTER_BAG                recorded after the correction
--model FILE, required   diagnosis.json that the correction is from
--program DIR            folder that correct wrote, where a program was corrected
""",
        options.ANY_ROBOT,
        """
--align FRAMES           frames that were set up anew since the diagnosis, and are fitted: base, tool,
                         or base,tool (default: both are as they were)
--out DIR                folder for verification.json and a page
rare:
--setup N                which recording of the diagnosis [default: 1]
""",
        options.FORCE,
        options.TOPICS,
    ),
)
_ISO9283 = Command(
    """Pose and path accuracy and repeatability by ISO 9283.

    Finds the poses that the arm stopped at twice or more, and the path that it went twice or more.
    Writes iso9283.json and a page to read (report.html) to the directory.
    """,
    'weld-twin iso9283 my_cycles --robot ur5 --out accuracy',
    (
        'BAG                      recording of the cell',
        options.ROBOT,
        options.ALIGN,
        options.folder_output('directory for the results'),
        options.TOPICS,
    ),
)
_SENSITIVITY = Command(
    """Which tolerance to tighten, by how much it moves the tool.

    For a robot on a seam, or for the motion of a bag. Writes sensitivity.json, indices, figures with
    their data and a page to read (sensitivity.html) to the directory; run again, it continues where
    it was stopped. --figure draws one figure only; --claims measures the paper's claims on several
    robots and seams.
    """,
    'weld-twin sensitivity --robot ur5 --path spline --out study',
    (
        '[BAG]                    study the motion recorded in a bag',
        options.ANY_ROBOT,
        options.folder_output('directory for the results'),
        """
what is studied:
--path P                 path file, or line, arc, circle, polyline, spline, weave [default: line]
--tolerances FILE        tolerance file (default: typical sizes of joint_offset, link_length,
                         link_twist, backlash and base_pose)
--effects-known FILE     effects file or diagnosis.json; the twin has these effects from the start
--figure K               draw figure 6 to 14, posture or recorded, and nothing else; may be given again
--claims                 measure the claims of the paper
of the seam, and of the claims:
rare:
--claims-robots R ...    robots of the claims (default: seven builds)
--tool X Y Z RX RY RZ    tool frame in the flange [m, rotation vector rad], instead of the model's
--points N               path points [default: 200]
--across M               weld tolerance across the seam [default: 5e-4]
--stickout M             weld tolerance of the stick-out [default: 1e-3]
--normal X Y Z           direction out of the work, for a recorded motion (default: against the wire)
how much is run, and where:
rare:
--samples N              Sobol base samples, a power of two [default: 1024]
--runs N                 runs of the tolerance stack [default: 20000]
--trajectories N         trajectories of the Morris screening [default: 50]
--placements N           placements tried for the advice [default: 32]
--seed N                 seed of all draws [default: 0]
--workers N              processes (default: one a core)
--scheduler ADDRESS      Dask scheduler to run on instead
""",
        options.TOPICS,
    ),
)
_SERVE = Command(
    """The diagnosis in a browser: drop a recording, read on.

    Only this machine reaches the server, unless --host says otherwise; whoever comes from elsewhere then
    needs the token, which is in the address that is printed. Recordings and results stay in --dir, and a
    server that is started again goes on with what waits.
    """,
    'weld-twin serve --dir served',
    (
        """
--dir DIR                where uploads and results lie [default: weld_twin_served]
--port N                 0: any that is free [default: 8765]
--host HOST              0.0.0.0 lets other machines in [default: localhost]
--token TEXT             what visitors need (default: drawn anew)
--db URL                 history of the plant, shown to everybody
--live                   show the verdict of running nodes
rare:
--name NAME              a host name or address that browsers use for this machine; may be given again
--behind-proxy           a proxy here tells in X-Forwarded-For whom it asks for
limits:
rare:
--workers N              side by side [default: 1]
--upload GB              of one recording [default: 1]
--disk GB                of everything that is kept [default: 20]
--memory GB              of one diagnosis [default: 6]
--minutes MIN            of one diagnosis [default: 15]
""",
    ),
)
_DEMO = Command(
    'The whole job on an example: live nodes, a bag, a page.',
    'weld-twin demo --out out',
    (
        options.folder_output('directory for the results', default='out'),
        '--closed-loop  weld the seam again through the compensator, and show both beside each other',
    ),
)
_CELL = '--cell NAME, required    whose history it is\n'
_USUAL_DATABASE = """
--db URL                 an SQLite file, or a URL such as postgresql+psycopg://user@host/name
                         [default: weld_twin_history.db]
"""
_DATABASE = '--db URL, required       an SQLite file, or postgresql+psycopg://...\n'
_ADD = f"""
DIAGNOSIS ...            diagnosis.json, or the directory that diagnose wrote; or what verify wrote
{_CELL}
--at DATE                when it was recorded, such as 2026-03-31; left out, the stamps of the recording
                         tell
"""
_CHANGED = f"""
{_CELL}
--since DATE             only what changed after it, or goes on, as wear and seasons do
--limit EFFECT=VALUE     largest value allowed of an effect, SI units, such as backlash=0.0017; may be
                         given again
--json                   print JSON instead of sentences
"""
_RUN = """
--keep DIR               also keep the page and the model of every recording there
--again                  run once more what a limit or a crash has ended
rare:
--memory GB              of each [default: 6]
--minutes MIN            of each [default: 10]
"""
_HISTORY = Command(
    """Cells over time: what changed, which one is worst.

    'add', 'show' and 'changed' keep the history of one cell. 'run' diagnoses the recordings of many
    cells side by side into one database, and 'page' ranks them.
    """,
    'weld-twin history changed --cell line3',
    jobs={
        'add': Command(
            'Add diagnoses to the history of a cell.',
            'weld-twin history add found --cell line3 --at 2026-03-31',
            (_ADD, _USUAL_DATABASE),
        ),
        'show': Command(
            'Show the diagnoses of a cell, or which cells there are.',
            'weld-twin history show --cell line3',
            ('--cell NAME              left out: list the cells', _USUAL_DATABASE),
        ),
        'changed': Command(
            """Say what changed, since when, and where it leads.

            A change is told where it is more than chance: one false alarm in a year of weekly looks.
            """,
            'weld-twin history changed --cell line3 --since 2026-03-31',
            (_CHANGED, _USUAL_DATABASE),
        ),
        'run': Command(
            """Diagnose the recordings of a list into a database.

            LIST is a table of text with commas and a first line of names: cell, recording and robot,
            and where they are needed at, align, effects_known, base_link, tip_link, contacts and apply.
            Paths are relative to the list. What is in the database already is not run again, so a run
            that was stopped goes on. A recording that cannot be read, or takes too much, is told and
            harms no other.
            """,
            'weld-twin history run examples/files/cells.csv --db plant.db',
            ('LIST                     table of recordings', _DATABASE, options.POOL, _RUN),
        ),
        'page': Command(
            'Write a page that ranks cells, and one for each cell.',
            'weld-twin history page --db plant.db --out plant',
            (_DATABASE, options.folder_output('directory for the pages')),
        ),
    },
)
ROWS = {
    'diagnose': _DIAGNOSE,
    'investigate': _INVESTIGATE,
    'correct': _CORRECT,
    'verify': _VERIFY,
    'history': _HISTORY,
    'iso9283': _ISO9283,
    'sensitivity': _SENSITIVITY,
    'serve': _SERVE,
    'demo': _DEMO,
}
