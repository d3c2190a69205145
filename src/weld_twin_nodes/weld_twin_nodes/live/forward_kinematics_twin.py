# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Forward-kinematics twin: where the model, with the effects known so far, has the tool."""

from functools import partial
from typing import Any

from weld_twin_core.twin.posterior import LivePosterior
from weld_twin_core.twin.twin import Twin
from weld_twin_msgs_py.files.posterior_entry import read_posterior
from weld_twin_msgs_py.messages.cdr import PoseCovarianceEncoder, PoseEncoder
from weld_twin_msgs_py.messages.from_messages import NANOSECONDS
from weld_twin_msgs_py.messages.topics import TWIN_BASE, TWIN_COVARIANCE, TWIN_POSE

from ..streams.twin_stream import Sample
from .model_node import ModelNode
from .robot_settings import measuring_frame
from .run_node import run

OUTSIDE = 'outside what was recorded'


class ForwardKinematicsTwin(ModelNode):
    """Publishes the twin's tool pose for every joint state, and how sure it is of it."""

    def __init__(self, **kwargs: Any) -> None:
        super().__init__('forward_kinematics_twin', **kwargs)
        self._pose = self.offer(TWIN_POSE)
        self._sure_pose = self.offer(TWIN_COVARIANCE, awaited=False)
        self._base = self.offer(TWIN_BASE, awaited=False)
        frame = measuring_frame(self)
        self._encode = PoseEncoder(frame)
        self._encode_sure = PoseCovarianceEncoder(frame)
        self._tell_base()
        self._sureness = self._read_sureness()
        self.start()

    def publish(self, sample: Sample) -> None:
        """Publish where the tool should be, at the stamp a measurement of it would carry."""
        position, rotation = sample.poses
        self._pose.publish(self._encode(sample.pose_stamp, position, rotation))
        if self._sureness is None:
            return
        shift, covariance = self._sureness.expected(
            self.stream.twin,
            sample.stamp / NANOSECONDS,
            sample.q,
            sample.wrench,
            sample.wrench_frame,
            sample.temperature,
            sample.effort,
        )
        why = '; '.join(self._sureness.outside)
        self.keep(OUTSIDE, f'{OUTSIDE}: {why}' if why else '', logged=False)
        self._sure_pose.publish(
            self._encode_sure(sample.pose_stamp, *sample.poses.displaced(shift), covariance)
        )

    def on_twin(self, twin: Twin) -> None:
        """Go on with changed effects, and with the certainty of the model as it is now."""
        super().on_twin(twin)
        self._tell_base()
        self._sureness = self._read_sureness()

    def _tell_base(self) -> None:
        """Tell where the base is by the model: a model that was aligned has fitted it."""
        base = self.stream.twin.robot.T_world_origin
        now = self.get_clock().now().nanoseconds
        self._base.publish(self._encode(now, base[:3, 3], base[:3, :3]))

    def _read_sureness(self) -> LivePosterior | None:
        """Return how sure the model is; None for an effects file or an older diagnosis."""
        path = self.setting('model')
        if not path.lower().endswith('.json'):
            return None
        posterior = read_posterior(self.robot, path)
        return None if posterior is None else LivePosterior(posterior)


main = partial(run, ForwardKinematicsTwin)


if __name__ == '__main__':
    raise SystemExit(main())
