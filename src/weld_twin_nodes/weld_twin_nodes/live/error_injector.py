# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Error injector: the stand-in for the real cell, moving as the injected effects have it."""

from functools import partial
from typing import Any, ClassVar

from weld_twin_core.twin.twin import Twin
from weld_twin_msgs_py.messages.cdr import JointStateEncoder, PoseEncoder
from weld_twin_msgs_py.messages.topics import ACTUAL_JOINT_STATES, MEASURED_POSE

from ..streams.twin_stream import Noise, Sample
from .model_node import ModelNode
from .robot_settings import measuring_frame
from .run_node import run
from .settings import Setting


class ErrorInjector(ModelNode):
    """Publishes the joint motion and the measured tool pose with the effects in them."""

    settings: ClassVar[tuple[Setting, ...]] = (
        *ModelNode.settings,
        Setting('seed', 0, 'seed of the measurement noise [1]', 0, 2**31 - 1),
    )

    def __init__(self, **kwargs: Any) -> None:
        super().__init__('error_injector', **kwargs)
        self._joints = self.offer(ACTUAL_JOINT_STATES, awaited=False)
        self._pose = self.offer(MEASURED_POSE)
        self._encode_joints = JointStateEncoder(self.robot.joint_names)
        self._encode_pose = PoseEncoder(measuring_frame(self))
        self._noise = Noise(self.stream.twin.effects, self.setting('seed'))
        self.start()

    def on_twin(self, twin: Twin) -> None:
        """Go on with changed effects, the noise among them."""
        super().on_twin(twin)
        self._noise.change(twin.effects)

    def publish(self, sample: Sample) -> None:
        """Publish where the joints and the tool really are."""
        self._joints.publish(self._encode_joints(sample.stamp, sample.q))
        position = sample.poses.position + self._noise.draw(1)[0]
        self._pose.publish(self._encode_pose(sample.pose_stamp, position, sample.poses.rotation))


main = partial(run, ErrorInjector)


if __name__ == '__main__':
    raise SystemExit(main())
