# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A node that works from its start to its end, or between the transitions of a managed node."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable
from typing import Any, ClassVar

from lifecycle_msgs.srv import ChangeState
from rclpy.lifecycle import LifecycleNodeMixin, LifecycleState, TransitionCallbackReturn

from weld_twin_core.errors import TwinError

from .cell_node import CellNode
from .settings import Setting

DONE, REFUSED = TransitionCallbackReturn.SUCCESS, TransitionCallbackReturn.FAILURE


class ManagedNode(LifecycleNodeMixin, CellNode):
    """
    Begins at once, or, with ``managed``, when it is configured and activated.

    A transition that cannot be made is refused with a sentence, and the node stays as it was.

    Attributes
    ----------
    active : bool
        Whether it works as a managed node just now.

    """

    settings: ClassVar[tuple[Setting, ...]] = (
        Setting(
            'managed',
            False,
            'work only between the transitions activate and deactivate of a managed node',
        ),
    )

    def __init__(self, name: str, **kwargs: Any) -> None:
        CellNode.__init__(self, name, **kwargs)
        self.active = False

    @abstractmethod
    def prepare(self) -> None:
        """Refuse what cannot work."""

    @abstractmethod
    def begin(self) -> None:
        """Begin the work."""

    @abstractmethod
    def finish(self) -> None:
        """End the work, so that it can begin again."""

    def start(self) -> None:
        """Begin, or offer the transitions; to be called when all else is there."""
        if not self.setting('managed'):
            self.begin()
            return
        LifecycleNodeMixin.__init__(self, enable_communication_interface=True)
        self._change = self._service_change_state.callback
        self._service_change_state.callback = self._try_to_change
        self._now('unconfigured')

    def on_configure(self, _: LifecycleState) -> TransitionCallbackReturn:
        """Look whether all that it needs is there."""
        return self._made(self.prepare, 'inactive')

    def on_activate(self, _: LifecycleState) -> TransitionCallbackReturn:
        """Begin."""
        self.active = self._made(self.begin, 'active') == DONE
        return DONE if self.active else REFUSED

    def on_deactivate(self, _: LifecycleState) -> TransitionCallbackReturn:
        """End."""
        made = self._made(self.finish, 'inactive')
        self.active = False
        return made

    def on_cleanup(self, _: LifecycleState) -> TransitionCallbackReturn:
        """Be as at first."""
        self._now('unconfigured')
        return DONE

    def on_shutdown(self, _: LifecycleState) -> TransitionCallbackReturn:
        """End for good."""
        made = self._made(self.finish, 'finalized')
        self.active = False
        return made

    def _made(self, action: Callable[[], None], state: str) -> TransitionCallbackReturn:
        """Do what a transition asks for; return whether it could be done."""
        try:
            action()
        except (TwinError, OSError) as error:
            self._tell_once(str(error))
            return REFUSED
        self._now(state)
        return DONE

    def _now(self, state: str) -> None:
        self.health.running = state
        self.get_logger().info(f'{state}, as a managed node')

    def _try_to_change(
        self, request: ChangeState.Request, response: ChangeState.Response
    ) -> ChangeState.Response:
        """Refuse a transition that the state does not have; rclpy would end the node."""
        try:
            return self._change(request, response)
        except Exception as error:  # an error of rclpy without a public name
            label = request.transition.label or request.transition.id
            self._tell_once(
                f'the transition {label} is refused, the node is {self.health.running}: {error}'
            )
            response.success = False
            return response
