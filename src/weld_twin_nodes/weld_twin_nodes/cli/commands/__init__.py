# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
The commands as a table, a row each; `..main` names them in the order of the help.

What a command does is the function `run` of the module of its name, or one of the name of its job. It
returns the exit code and raises a TwinError for anything the user can mend. A module is loaded when its
command runs, not for its help. Options that few need are rare: `--help` fits on one screen without them.
"""

from .. import options
from ..parsing import Command

OF_SEAM = """
of a seam:
--effects E.yaml         effects to inject
--path P                 path file, or line, arc, circle, polyline, spline, weave (default: line)
--profile LAW            time law: constant, trapezoid, s-curve, smooth, aggressive (default: smooth)
--speed M/S              travel speed (default: as fast as profile and joints allow)
--rate HZ                samples a second (default: 125)
--seed N                 seed of the measurement noise (default: 0)
rare:
--start-stamp NANOS      stamp of the first sample (default: 1 s)
--allow-implausible      take values that no machine comes near, for a study of extremes
"""
OF_RECORDING = """
of a recording:
--temperature DEGC       of the arm, where the bag has none or another is meant
--table FILE.csv         also write the poses as a table, with standard deviations
rare:
--setup N                recording of the diagnosis whose set-up is meant, if the set-up moved between
                         them
"""
_SIMULATE = Command(
    """The twin offline: a bag of a seam, or of a recording.

    Without a BAG: everything that the live nodes would publish along a seam. With a BAG and a --model:
    the tool pose of the twin with these effects at every joint state, in the frame of the measurements:
    what the instrument would read at each stamp.
    """,
    'weld-twin simulate --robot ur5 --effects bags/elbow_play.yaml --path spline --out my_bag',
    (
        '[BAG]                    recording with joint states; left out, a seam is simulated',
        options.ROBOT,
        '--model FILE             effects that the twin knows: diagnosis.json, or an effects file',
        options.BAG_OUTPUT,
        OF_SEAM,
        OF_RECORDING,
        options.TOPICS,
    ),
)
_DETECT = Command(
    """Find a board in images: a table of pixels for weld-twin import.

    OpenCV finds the corners. The table goes to weld-twin import with --camera and --target. --joints
    has a row for every image, in their order, or a column 'image' that names it.
    """,
    'weld-twin detect images --board board.yaml --joints joints.csv --out pixels.csv',
    (
        """
IMAGE ...                images, or a folder of them
--board FILE.yaml, required  charuco, chessboard or tags: kind, squares, their side, and markers, as
                         docs/cameras.md has it
--camera NAME            what the table calls the camera [default: camera]
--joints FILE.csv        joint angles of every image
""",
        options.file_output('table to write'),
    ),
)
_IMPORT = Command(
    """Make a bag of a table of what was measured, seen or touched.

    Delimiter, units and columns are read from the table where they are plain, and every guess is
    printed; an option settles what is not. Lists of columns are separated by commas. For pixels of
    cameras give --camera and --target; weld-twin detect makes a table of images.
    """,
    'weld-twin import examples/files/measurements.csv --robot ur5 --out my_cell',
    (
        'FILE.csv                 table of text',
        options.ROBOT,
        options.BAG_OUTPUT,
        """
--contacts ARTEFACT.yaml  FILE.csv has joint angles and what was touched; this file describes it
rare:
--table CSV              also write every deviation from the twin
--picture PNG            also draw the deviations
""",
        options.CAMERAS,
        options.TABLE,
    ),
)
_BAG = Command(
    """Look into a bag, make a damaged one whole, play it.

    'weld-twin bag BAG' alone tells what is in it.
    """,
    'weld-twin bag bags/elbow_play',
    usual='info',
    jobs={
        'info': Command(
            'What is in a bag, what of it is usable, its rates and gaps.',
            'weld-twin bag info bags/elbow_play',
            (
                """
[BAG]                    rosbag2 directory, .mcap or .db3
--robots                 list the bundled robots and your own instead
""",
                options.TOPICS,
            ),
        ),
        'recover': Command(
            """Make a bag of what is whole of a damaged one.

            BAG is what the recorder was told to write. The original stays as it is; delete it when you
            have looked at the new one.
            """,
            'weld-twin bag recover my_recording',
            (
                """
BAG                      bag, its .unfinished directory, or a file
--out BAG2               bag to write (default: the name the recording should have, or BAG_recovered)
""",
            ),
        ),
        'play': Command(
            """Play a bag into running nodes, without `ros2 bag play`.

            Messages go out as they were recorded, header stamps included. Nodes that take the time from
            the recording are started with use_sim_time and need --clock.
            """,
            'weld-twin bag play bags/elbow_play --clock',
            (
                """
BAG                      rosbag2 directory, .mcap or .db3
--rate X                 2 plays twice as fast as recorded [default: 1]
--clock [HZ=100]         publish the time of the recording on /clock, HZ times a second (100 if left
                         out)
--topics TOPIC ...       play only these
--loop [N=0]             play N times; without N, until stopped
rare:
--subscribers N          start when every topic has so many subscribers [default: 1]
--wait S                 start after S seconds in any case [default: 5]
""",
            ),
        ),
    },
)
_OUT = options.file_output('file to write (default: print it)')
_EXPORT = Command(
    """A corrected model, a robot program, a policy, a schema.

    'weld-twin export found/diagnosis.json' alone writes the model.
    """,
    'weld-twin export found/diagnosis.json --robot ur5 --format urdf --out better.urdf',
    usual='model',
    jobs={
        'model': Command(
            'Write the model of a diagnosis as other software loads it.',
            'weld-twin export model found/diagnosis.json --robot ur5 --format offsets',
            (
                'MODEL                    diagnosis.json',
                options.ROBOT,
                """
--format {yaml,urdf,offsets,effects,left-over}  yaml, urdf: the corrected robot; offsets: a CSV, a
                         row a joint; effects: all, for the nominal robot; left-over: those that a
                         corrected robot cannot hold [default: yaml]
""",
                _OUT,
            ),
        ),
        'program': Command(
            """Write a seam or an experiment as a robot program.

            The experiment is the next_experiment.yaml of a diagnosis, or any path file. Beside the
            program goes a sheet that says how to load it, and how to record joints and poses.
            """,
            'weld-twin export program spline --robot ur5 --controller urscript --out seam.script',
            (
                'PATH                     path file, experiment, or a bundled seam such as line',
                options.ROBOT,
                """
--controller NAME, required  urscript, krl, rapid, inform, fanuc-ls, joint-trajectory or csv
""",
                options.file_output('program to write'),
                """
--full-speed             after the first run: joints at most half speed, tool 250 mm/s, not a tenth
                         and 50 mm/s
--speed V                of a seam, such as 8mm/s; left out, its own
--dwell S                stay at each station [default: 2]
""",
                options.TRIGGER,
                options.PROGRAM,
            ),
        ),
        'policy': Command(
            """Write the security policy of the nodes, for SROS2.

            Each node may publish, hear, answer and ask what it does, and nothing else. Give the
            namespace and the remaps that the nodes are started with.
            """,
            'weld-twin export policy --namespace left --remap joint_states:=/cell/states --out left.xml',
            (
                """
--namespace NS           namespace of the nodes
--remap FROM:=TO         a name the nodes have and the one they get; may be given again
--nodes NODE ...         nodes it is for (default: all)
""",
                _OUT,
            ),
        ),
        'schema': Command(
            'The JSON Schema of a robot, effects, seam or artefact file.',
            'weld-twin export schema robot --out robot.schema.json',
            ('KIND                     robot, effects, seam or artefact', _OUT),
        ),
    },
)
ROWS = {
    'simulate': _SIMULATE,
    'detect': _DETECT,
    'import': _IMPORT,
    'bag': _BAG,
    'export': _EXPORT,
}
