# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Compensator: moves poses and trajectory goals so that the real tool goes where they mean."""

import sys
import time
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, ClassVar

import numpy as np
from rclpy.task import Future

from weld_twin_core.arm.rotation import transform
from weld_twin_core.twin.goal_correction import CorrectedGoal, GoalLimits, Refusal
from weld_twin_core.twin.pose_correction import PoseCorrection
from weld_twin_core.twin.program_model import ProgramModel
from weld_twin_msgs_py.assembly import Intake, Role
from weld_twin_msgs_py.assembly.frames import PlannedFrame
from weld_twin_msgs_py.messages import from_messages, topics
from weld_twin_msgs_py.messages.cdr import PoseEncoder, TwistEncoder
from weld_twin_msgs_py.messages.goals import corrected_trajectory

from ..offline.correcting import LoadedModel, loaded
from ..streams.looks_beside import LooksBeside
from ..streams.pose_stream import PoseStream
from ..streams.supervision import ArmState, Moving, Supervision
from .cell_node import CellNode
from .goals import Decision, GoalAudit, GoalJudge, GoalRelay, Judged
from .managed_node import ManagedNode
from .robot_settings import CHANGED as ROBOT_CHANGED
from .robot_settings import JOINT_SETTINGS, ROBOT_SETTINGS, base_frame, robot_of, say_doubts
from .run_node import run
from .settings import Setting
from .source import full_names, named

COMPENSATOR_SETTINGS = (
    Setting(
        'managed',
        True,
        'work only between the transitions activate and deactivate of a managed node; else at once',
    ),
    *ROBOT_SETTINGS,
    *JOINT_SETTINGS,
    Setting('model', '', 'diagnosis.json of this arm; ~/reload reads it again', live=True),
    Setting(
        'controller',
        'joint_trajectory_controller',
        'controller whose action follow_joint_trajectory corrected goals go to',
    ),
    Setting('apply', False, 'send what is corrected; else tell the correction alone', live=True),
    Setting(
        'on_refusal',
        'stop',
        'what becomes of poses that are refused: stop (nothing is sent) or pass; goals are rejected',
        live=True,
        choices=('stop', 'pass'),
    ),
    Setting('max_correction_m', 2e-3, 'longest way a pose may be moved [m]', 0.0, 0.1, live=True),
    Setting(
        'max_correction_rad',
        float(np.pi / 180.0),
        'largest turn a pose may be moved by [rad]',
        0.0,
        0.2,
        live=True,
    ),
    Setting('max_rate_m_s', 0.05, 'fastest change of that way [m/s]', 1e-6, 10.0, live=True),
    Setting('max_rate_rad_s', 0.2, 'fastest change of that turn [rad/s]', 1e-6, 100.0, live=True),
    Setting(
        'max_acceleration',
        20.0,
        'largest acceleration of a joint in what is corrected [rad/s^2, m/s^2]; the robot file may '
        'say less',
        1e-6,
        1e4,
        live=True,
    ),
    Setting(
        'max_model_age',
        0.0,
        'age of the model file above which nothing is corrected [s]; 0: any',
        0.0,
        1e10,
        live=True,
    ),
    Setting(
        'max_age',
        1.0,
        'age of the last joint state above which it is not known where the arm stands [s]',
        0.05,
        3600.0,
    ),
    Setting('audit', '', 'file that the audit line of every goal is added to; none when empty'),
)


def limits_of(node: CellNode) -> GoalLimits:
    """Return what a correction may do at most, by the parameters of a node."""
    names = ('correction_m', 'correction_rad', 'rate_m_s', 'rate_rad_s', 'acceleration')
    return GoalLimits(*(node.setting(f'max_{name}') for name in names))


INACTIVE = 'the compensator is not active; configure and activate it'
CHANGED = 'the model was exchanged while the goal was worked out; send it again'
SHORT_TURN = 2e-4
"""Seconds after which threads take turns: what is worked out beside a pose must not keep it waiting."""
LOOK_EVERY = 0.5
"""Seconds between two looks at whether the model is to be used still."""
WITHDRAWN = 'withdrawn'
"""Under which the node keeps why it corrects nothing."""


class Compensator(ManagedNode):
    """
    Corrects what a planner sends to a controller, whole, or refuses it with a reason.

    In the shadow, without ``apply``, goals pass as they are and no pose is sent; what would be added
    is reported all the same.
    """

    settings: ClassVar[tuple[Setting, ...]] = COMPENSATOR_SETTINGS

    def __init__(self, **kwargs: Any) -> None:
        super().__init__('compensator', **kwargs)
        sys.setswitchinterval(SHORT_TURN)
        self.robot = robot_of(self)
        self._intake = Intake(self.robot, joint_names=self.joint_names, mend=True)
        self._arm = ArmState()
        self._moving: Moving | None = None
        self._around: tuple[Any, float | None] = (None, None)
        self._streamed: tuple[Any, float | None] = self._around
        self._model: LoadedModel | None = None
        self._active = False
        self._reported = self._outdated = ''
        self._watch = Supervision()
        self._listened, self._most_age = False, self.setting('max_age')
        self._stream: PoseStream | None = None
        self._looks: LooksBeside | None = None
        self._judge = GoalJudge(self)
        self._out = self.offer(topics.POSE_OUT)
        self.partners.append(self._senders_beside)
        self._correction = self.offer(topics.CORRECTION, awaited=False)
        self._audit = GoalAudit(self)
        self._frame = PlannedFrame(self.setting('base_frame'))
        self._encoders: dict[str, tuple[PoseEncoder, TwistEncoder]] = {}
        self.answer('~/reload', self._reload)
        self.listen(topics.TOOL_WRENCH, self._on_wrench, hold_last=True)
        self.listen(topics.TEMPERATURE, self._on_temperature, hold_last=True)
        self.listen(topics.JOINT_STATES, self._on_joints)
        self.listen(topics.DEVIATION, self._on_deviation)
        self.listen(topics.POSE_IN, self._on_pose)
        self._relay = self._offer_action()
        self.every(LOOK_EVERY, self._look)
        self.start()

    def own_topics(self) -> list[str]:
        """Return the topics under the node's own name."""
        return [topic.relative for topic in topics.COMPENSATED]

    def _offer_action(self) -> GoalRelay | None:
        try:
            from control_msgs.action import FollowJointTrajectory
        except ImportError:
            self.remark(
                'control_msgs is not installed: poses are corrected, and no action is offered'
            )
            return None
        return GoalRelay(
            self, FollowJointTrajectory, self.setting('controller'), self._decide, self._since
        )

    # Transitions -----------------------------------------------------------------------------

    def prepare(self) -> None:
        """Read the model; refuse one of another arm, or of unsound data."""
        self._take_model()

    def begin(self) -> None:
        """Correct from now on."""
        if self._model is None or str(self._model.path) != self.setting('model'):
            self._take_model()
        assert self._model is not None
        self._watch = Supervision(self._model.promised)
        self._active = True
        self._renew_stream()
        self._look()

    def finish(self) -> None:
        """Correct no more; a goal that runs ends as begun."""
        self._active = False
        self._stream, self._watch = None, Supervision()

    def destroy_node(self) -> None:
        """End what is worked out beside; what became of goals is written before."""
        self._audit.close()
        if self._looks is not None:
            self._looks.close()
        if self._relay is not None:
            self._relay.close()
        super().destroy_node()

    def time_went_back(self) -> None:
        """Forget where the arm stands and what was measured."""
        self._intake.reset()
        self._arm.forget()
        self._watch.forget()

    def _take_model(self) -> None:
        self._model = loaded(self.robot, self.setting('model'))
        read = self._model.read
        # What a posterior leaves open lies on both sides of zero.
        say_doubts(self, read.robot, read.effects if read.posterior is None else ())
        if read.posterior is None:
            self.remark(
                'the model does not say how sure it is nor where it was recorded: neither is looked at'
            )
        self._watch = Supervision(self._model.promised)
        lawless = [self.robot.index(name) for name in read.lawless]
        self._moving = Moving(lawless) if lawless else None
        self.get_logger().info(f'model {self._model.digest}: {len(read.effects)} effects')

    def _reload(self) -> str:
        """Go on with the file as it is now; a goal that runs ends with the one before."""
        self._take_model()
        if self._active:
            self._renew_stream()
        self._look()
        return f'model {self._token()}'

    def why_not(self, name: str, value: Any) -> str:
        """Return that nothing changes while goals may come."""
        return f'{name} may be set while the compensator is not active' if self._active else ''

    # What is known ---------------------------------------------------------------------------

    def intakes(self) -> Sequence[Intake]:
        return (self._intake,)

    def _on_wrench(self, message: Any) -> None:
        taken = self._intake.take(Role.WRENCH, message)
        if taken is not None:
            self._around = (taken.row, self._around[1])

    def _on_temperature(self, message: Any) -> None:
        taken = self._intake.take(Role.TEMPERATURE, message)
        if taken is not None:
            self._around = (self._around[0], float(taken.row[0]))

    def _on_joints(self, message: Any) -> None:
        taken = self._intake.joint_sample(message)
        if taken is None:
            return
        if taken[1]:
            self._arm.forget()
        self._arm.take(taken[0][1], time.monotonic())
        if self._moving is not None:
            self._moving.take(taken[0][0], taken[0][1])

    def _on_deviation(self, message: Any) -> None:
        now = time.monotonic()
        arm = self._arm.where(now, self._most_age)
        recorded = arm is None or self._model is None or self._model.read.recorded(arm[None])[0]
        moving = self._moving is None or self._moving.at(from_messages.stamp_ns(message))
        if not (recorded and moving):
            self._watch.pass_over(now)
            return
        self._watch.take(from_messages.vector3(message), now)

    def _withdrawn(self) -> str:
        """Return why nothing is to be corrected now; empty where there is nothing."""
        if not self._active or self._model is None:
            return INACTIVE
        return self._outdated or self._watch.withdrawn(time.monotonic())

    def _look(self) -> None:
        """Look at the model file, and tell that the model is withdrawn, or is not any more."""
        self._listened = self._correction.get_subscription_count() > 0
        if self._stream is not None and self._around is not self._streamed:
            self._stream.renew(self._pose_correction())
        if self._looks is not None and self._looks.lost:
            self.remark(
                'the process for exact looks has ended; this node makes them between poses'
            )
        if self._model is not None:
            self._outdated = (
                self.health.lasting.get(ROBOT_CHANGED)
                or self._model.outdated(self.setting('max_model_age'))
                or self._twice()
            )
        why = self._withdrawn() if self._active else ''
        if why != self._reported and why.partition(':')[0] != self._reported.partition(':')[0]:
            self.get_logger().warning(why or 'the model is used again')
        self._reported = why
        self.keep(WITHDRAWN, why, logged=False)

    def _twice(self) -> str:
        """Return that another compensator takes what is sent; empty where none does."""
        takers = full_names(self.get_subscriptions_info_by_topic(self._out.topic))
        if self._relay is not None:
            takers.add(self.resolve_topic_name(self._relay.below).rpartition('/')[0])
        for name in sorted(takers):
            if self.count_publishers(f'{name}/{topics.AUDIT.relative.removeprefix("~/")}'):
                return (
                    f'{name}, which takes what is sent, is a compensator: it would correct twice'
                )
        return ''

    def _senders_beside(self) -> list[str]:
        """Return who else sends poses where this node does."""
        own, topic = self.get_fully_qualified_name(), self._out.topic
        return [
            f'{named(name)} publishes {topic}, too: who takes it follows both by turns; end one of them'
            for name in sorted(full_names(self.get_publishers_info_by_topic(topic)) - {own})
        ]

    def _present(self) -> ProgramModel:
        assert self._model is not None
        wrench, warm = self._around
        return self._model.around(wrench, self._intake.wrench_frame.meaning, warm)

    # Poses -----------------------------------------------------------------------------------

    def _pose_correction(self) -> PoseCorrection:
        self._streamed = self._around
        return PoseCorrection(self._present(), self.robot.T_flange_tool)

    def _renew_stream(self) -> None:
        correction = self._pose_correction()
        for name in correction.left_out:
            self.remark(f'{name} is not corrected in poses, which do not tell what comes next')
        if self._looks is None or self._looks.lost:
            self._looks = LooksBeside()
        self._stream = PoseStream(
            correction,
            limits_of(self),
            passing=self.setting('on_refusal') == 'pass',
            shadow=not self.setting('apply'),
            beside=self._looks,
        )

    def _on_pose(self, message: Any) -> None:
        self._frame.take(message.header.frame_id)
        stream = self._stream
        if stream is None:
            self.refuse(self.resolve_topic_name(topics.POSE_IN.relative), INACTIVE)
            if self.setting('on_refusal') == 'pass' and self.setting('apply'):
                encode, _ = self._encoder(message.header.frame_id)
                self._out.publish(
                    encode(from_messages.stamp_ns(message), *from_messages.pose(message))
                )
        else:
            self._on_pose_for(stream, message)
        self.remark(self._frame.remark)

    def _on_pose_for(self, stream: PoseStream, message: Any) -> None:
        """Send what becomes of a pose; all that may be late comes after that."""
        position, rotation = from_messages.pose(message)
        stamp = from_messages.stamp_ns(message)
        encode, encode_twist = self._encoder(message.header.frame_id)
        arm = self._arm.where(time.monotonic(), self._most_age)
        # Of poses that come in a burst, the stamps tell how far they are apart.
        given = stream.take(transform(rotation, position), stamp * 1e-9, arm, self._withdrawn())
        if given.pose is not None:
            self._out.publish(encode(stamp, given.pose[:3, 3], given.pose[:3, :3]))
        if given.added is not None and self._listened:
            self._correction.publish(encode_twist(stamp, given.added))
        if given.why:
            self.refuse(self.resolve_topic_name(topics.POSE_IN.relative), given.why)
        stream.settle()

    def _encoder(self, frame_id: str) -> tuple[PoseEncoder, TwistEncoder]:
        if frame_id not in self._encoders:
            self._encoders[frame_id] = PoseEncoder(frame_id), TwistEncoder(frame_id)
        return self._encoders[frame_id]

    # Goals -----------------------------------------------------------------------------------

    async def _decide(self, goal: Any) -> Decision:
        self._look()
        token = self._token()
        audit = self._audit
        if not goal.trajectory.points:  # the order to stop, which nothing may hold up
            why = 'it has no point'
            return Decision(goal, '', partial(audit.settle, token, None, 'passed', why))
        applied, why = self.setting('apply'), self._withdrawn()
        if why:
            passed = goal if not applied and self._active else None
            return Decision(passed, why, partial(audit.settle, token, None, 'refused', why), token)
        if not applied:  # it does not wait for what is only reported
            return Decision(goal, '', partial(self._judged_later, goal), token)
        judged, watch = Future(), self._watch
        self._work_out(goal, judged.set_result)
        result, columns = await judged
        if self._watch is not watch:  # there is one for every model and activation
            why = self._withdrawn() or CHANGED
            return Decision(None, why, partial(audit.settle, token, None, 'refused', why), token)
        settled = partial(audit.judged, token, result)
        if isinstance(result, Refusal):
            return Decision(None, result.reason, settled, token)
        trajectory = corrected_trajectory(goal.trajectory, columns, result.goal, result.waits)
        rest = [name for name in goal.get_fields_and_field_types() if name != 'trajectory']
        sent = type(goal)(trajectory=trajectory, **{name: getattr(goal, name) for name in rest})
        self._tell_added(goal.trajectory.header, result)
        return Decision(sent, '', settled, token)

    def _judged_later(self, goal: Any, below: str) -> None:
        """Tell of a goal that was passed on what a correction would have done."""

        def tell(judged: Judged) -> None:
            if isinstance(judged[0], CorrectedGoal):
                self._tell_added(goal.trajectory.header, judged[0])
            self._audit.judged(self._token(), judged[0], below)

        self._work_out(goal, tell)

    def _work_out(self, goal: Any, done: Callable[[Judged], None]) -> None:
        """Have a goal worked out beside, with what is known now."""
        start = self._arm.start(time.monotonic(), self.setting('max_age'))
        names = self._intake.joints.names
        self._judge.judge(goal, names, self._present(), limits_of(self), start, done)

    def _tell_added(self, header: Any, result: CorrectedGoal) -> None:
        """Publish what is added at every point, at the time when the arm is to be there."""
        begun = from_messages.time_ns(header.stamp) or self.get_clock().now().nanoseconds
        encode = self._encoder(base_frame(self))[1]
        for t, added in zip(result.goal.t, result.added, strict=True):
            self._correction.publish(encode(begun + round(float(t) * 1e9), added))

    def _token(self) -> str | None:
        return None if self._model is None else self._model.digest

    def _since(self, token: object) -> str:
        """Return what has happened to the model since a goal was decided on."""
        self._look()
        if self._token() != token:
            return 'the model was exchanged meanwhile'
        why = self._withdrawn()
        return f'the model was withdrawn meanwhile: {why}' if why else ''


main = partial(run, Compensator)


if __name__ == '__main__':
    raise SystemExit(main())
