# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Options that several commands share, as tables that `parsing` reads; `given` says what they mean."""

ROBOT = """
--robot R, required      a robot of 'weld-twin bag --robots', a robot file or a URDF
chain of a URDF:
rare:
--base-link LINK         first link of the chain; the controller's base is there too
--tip-link LINK          last link of the chain
--flange-link LINK       the controller's flange (default: tool0, flange or as it moves)
"""
ANY_ROBOT = ROBOT.replace(', required', '')
"""The same where something else may tell the robot."""
ALIGN = """
--align FRAMES           frames that are not known, and are fitted: base, tool, or base,tool
"""
CAMERAS = """
cameras:
rare:
--camera NAME=FILE       camera_info of a camera, with mount: tool or world; may be given again
--target NAME=FILE       points of a target or numbers of a board [m], with mount: tool or world;
                         may be given again
"""
TOPICS = f"""
topics, for bags recorded elsewhere:
rare:
--namespace NS           namespace of the robot; left stands for /left/...
--joint-topic TOPIC      JointState, DynamicJointState or JointTrajectoryControllerState
                         (TOPIC:feedback)
--pose-topic TOPIC       PoseStamped, PoseWithCovarianceStamped, TransformStamped, /tf:FRAME, or a
                         JointTrajectoryControllerState, of which the pose of the feedback is taken
--point-topic TOPIC      of the point
--image-topic TOPIC      PointCloud2 of target, point, u, v; or AprilTagDetectionArray
--wrench-topic TOPIC     of the wrench
--temperature-topic TOPIC  of the temperature
--joint-prefix TEXT      what the joint states put before the robot's joint names (default: any one
                         prefix)
--joint-map JOINT=NAME ...  joints of the robot and what the joint states call them, such as
                         joint_1=A1
--measured-inverse       the poses are those of something fixed seen from the arm, as of a board by
                         a camera
--use-effort             springs of joints take JointState.effort [N m] for their load, not the
                         model's statics
{CAMERAS}"""
POOL = """
--workers N              processes; 0 takes all cores [default: 0]
rare:
--scheduler ADDRESS      Dask cluster to run on instead; it must see the same directories
"""
FORCE = """
rare:
--force                  write also where files of yours are in the way; they are kept as NAME.kept-1
"""
STORAGE = """
rare:
--storage {mcap,sqlite3}  form of the bag: mcap or sqlite3 [default: mcap]
"""
BAG_OUTPUT = f"""
--out BAG, required      bag to write; it must not exist yet
{STORAGE}"""
PROGRAM = """
how the numbers of a program are meant:
rare:
--tool NAME=X,Y,Z,...    numbers of a tool that the program only names, as the controller shows them
                         (mm and degrees, ABB with a quaternion, Universal Robots in m and rad); may
                         be given again
--base NAME=X,Y,Z,...    the same of a base (user frame, work object); may be given again
--pulses-per-degree N,N,...  of every axis of a Yaskawa arm whose points are in pulses
--external E=JOINT,...   which joint of the robot file each external axis is, such as
                         E1=rail,E2=-tilt (KUKA), eax_a=rail (ABB), GP2.J1=tilt (FANUC); a minus
                         where it counts the other way
--on-positioner NAME,...  bases that go along with the positioner, where the program does not say; or
                         none
--world X,Y,Z,...        where a track begins in the controller's world, for positions in frames that
                         stand still
"""
TRIGGER = """
rare:
--trigger N              digital output that tells the instrument when to measure [default: 1]
"""
TABLE = """
--measured FILE          the table has the joints alone; this one has what the instrument measured
rare:
--clamped                both ends of the chain hold one bar, and the table has joint angles alone
--clock-offset S         added to the stamps of --measured [default: 0]
where the header does not tell:
--length-unit {m,mm,cm,um,in,ft}  unit of lengths
--angle-unit {rad,deg}   unit of the joint angles
rare:
--slide-unit {m,mm}      unit of joints that slide
--rotation-unit {rad,deg}  unit of measured angles
--rotation ORDER         order of the angles: XYZ, ZYX, ... (intrinsic), or rotvec
how to read the table:
rare:
--joint-columns A,B,C    columns of the joint
--position-columns A,B,C  columns of the position
--target-columns A,B,C   columns of the target
--difference-columns A,B,C  columns of the difference
--rotation-columns A,B,C  columns of the rotation
--sigma-columns A,B,C    columns of the sigma
--temperature-column A   column of the temperature
--time-column A          column of the stamps
--difference {add,subtract}  whether measured is target plus or minus difference [default: add]
--positions-only         do not read orientations
--skip-rows N,N          rows to leave out; the first row under the header is 1
--marker NAME            what is meant, where an export has several markers
--delimiter SIGN         comma, semicolon or tab
--decimal SIGN           sign of decimals: . or ,
how the controller counts its joints:
--joint-signs 1,-1,...   -1 for every joint that the controller counts the other way than the model
--joint-offsets DEG,DEG,...  added to every joint [deg, mm for a slide], such as 0,-90,90,0,0,0
--coupled 3+2            the model's joint 3 is that of the table plus joint 2; 3-2 takes it off
"""
RARE_TABLE = f'tables:\n{TABLE}'.replace(':\n', ':\nrare:\n')
"""The same where tables are rarely given."""


def folder_output(text: str, default: str = '') -> str:
    """Return the options of a command that writes a folder of files."""
    required, usual = ('', f' [default: {default}]') if default else (', required', '')
    return f'--out DIR{required}  {text}{usual}\n{FORCE}'


def file_output(text: str) -> str:
    """Return the options of a command that writes one file; ``text`` may say what is done without."""
    required = '' if '(default:' in text else ', required'
    return f'--out FILE{required}  {text}\n{FORCE}'
