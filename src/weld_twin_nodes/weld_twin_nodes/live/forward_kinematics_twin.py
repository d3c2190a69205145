# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Forward-kinematics twin: where the model, with the effects known so far, has the tool."""

from __future__ import annotations

from typing import Any

from weld_twin_msgs_py.assembly.frame_names import WORLD
from weld_twin_msgs_py.messages.cdr_write import PoseEncoder
from weld_twin_msgs_py.messages.topics import TWIN_POSE

from ..streams.twin_stream import Sample
from .model_node import ModelNode
from .run_node import run


class ForwardKinematicsTwin(ModelNode):
    """Publishes the twin's tool pose for every joint state."""

    def __init__(self, **kwargs: Any) -> None:
        super().__init__('forward_kinematics_twin', **kwargs)
        self._pose = self.offer(TWIN_POSE)
        self._encode = PoseEncoder(WORLD)
        self.start()

    def publish(self, sample: Sample) -> None:
        """Publish where the tool should be, at the stamp a measurement of it would carry."""
        position, rotation = sample.poses
        self._pose.publish(self._encode(sample.pose_stamp, position, rotation))


def main(args: list[str] | None = None) -> int:
    """Run the node."""
    return run(ForwardKinematicsTwin, args)


if __name__ == '__main__':
    raise SystemExit(main())
