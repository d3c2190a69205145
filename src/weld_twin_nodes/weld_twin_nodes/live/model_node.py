# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What the injector and the twin share: a robot, effects that can be changed, a joint stream."""

from abc import abstractmethod
from collections.abc import Sequence
from typing import Any, ClassVar

from rclpy.parameter import Parameter

from weld_twin_core.errors import TwinError
from weld_twin_core.twin.twin import Twin
from weld_twin_msgs_py.assembly import Intake
from weld_twin_msgs_py.messages.topics import JOINT_STATES, TEMPERATURE, TOOL_WRENCH

from ..offline.given_twin import build_twin
from ..streams.twin_stream import JointStream, Sample
from .cell_node import CellNode
from .robot_settings import JOINT_SETTINGS, ROBOT_SETTINGS, place_twin, robot_of
from .settings import Setting

MODEL_SETTINGS = (
    *ROBOT_SETTINGS,
    *JOINT_SETTINGS,
    Setting(
        'model',
        '',
        'effects file, or diagnosis.json with the effects found; ~/reload reads it again',
    ),
    Setting('effects', '', 'more effects, as the YAML list of an effects file', live=True),
)


class ModelNode(CellNode):
    """Steps a twin with every joint state; its effects may change between two messages."""

    settings: ClassVar[tuple[Setting, ...]] = MODEL_SETTINGS

    def __init__(self, name: str, **kwargs: Any) -> None:
        super().__init__(name, **kwargs)
        self.robot = robot_of(self)
        self.stream = JointStream(self._twin(self.setting('effects')), self.joint_names)
        self.add_post_set_parameters_callback(self._changed)
        self.answer('~/reload', self._reload)

    def start(self) -> None:
        """Take input; to be called when the outputs are there."""
        self.listen(TOOL_WRENCH, self.stream.take_wrench, hold_last=True)
        self.listen(TEMPERATURE, self.stream.take_temperature, hold_last=True)
        self._input = self.listen(JOINT_STATES, self._on_joints, required=True)

    def time_went_back(self) -> None:
        """Forget the motion so far."""
        self.stream.reset()

    def _on_joints(self, message: Any) -> None:
        sample = self.stream.step(message)
        if sample is not None:
            self.publish(sample)

    def intakes(self) -> Sequence[Intake]:
        joints = self.stream.intake.joints
        self._input.others = joints.others + joints.parts
        return (self.stream.intake,)

    @abstractmethod
    def publish(self, sample: Sample) -> None:
        """Publish what follows from one joint state."""

    def on_twin(self, twin: Twin) -> None:
        """Go on with changed effects."""
        self.stream.change(twin)

    def _twin(self, effects: str) -> Twin:
        return place_twin(self, build_twin(self.robot, self.setting('model'), effects))

    def why_not(self, name: str, value: Any) -> str:
        """Return what is wrong with effects that are set."""
        try:
            if name == 'effects':
                self._twin(value)
        except TwinError as error:
            return str(error)
        return ''

    def _changed(self, parameters: list[Parameter]) -> None:
        if any(parameter.name == 'effects' for parameter in parameters):
            self.on_twin(self._twin(self.setting('effects')))

    def _reload(self) -> str:
        twin = self._twin(self.setting('effects'))
        self.on_twin(twin)
        return f'{len(twin.effects)} effects'
