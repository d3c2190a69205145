# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
A node that works all the time, or between transitions (design.ros2.org/articles/node_lifecycle.html).

The standard services are offered here, not by rclpy's mixin: that one serves nothing else until a
transition is over, and ends a node that is asked for one which its state does not have.
"""

from abc import abstractmethod
from collections.abc import Callable
from functools import partial
from typing import Any, ClassVar, NamedTuple

from lifecycle_msgs.msg import State, Transition, TransitionDescription, TransitionEvent
from lifecycle_msgs.srv import ChangeState, GetAvailableStates, GetAvailableTransitions, GetState

from weld_twin_core.errors import TwinError

from .cell_node import CellNode
from .settings import Setting

STATES = {
    getattr(State, name): name.removeprefix('PRIMARY_STATE_').lower()
    for name in (
        'PRIMARY_STATE_UNCONFIGURED',
        'PRIMARY_STATE_INACTIVE',
        'PRIMARY_STATE_ACTIVE',
        'PRIMARY_STATE_FINALIZED',
    )
} | {
    getattr(State, f'TRANSITION_STATE_{name.upper()}'): name
    for name in ('configuring', 'cleaningup', 'shuttingdown', 'activating', 'deactivating')
}


class Step(NamedTuple):
    """A transition: its number and name, and the states before, meanwhile and afterwards."""

    number: int
    label: str
    start: str
    meanwhile: str
    goal: str


STEPS = (
    Step(Transition.TRANSITION_CONFIGURE, 'configure', 'unconfigured', 'configuring', 'inactive'),
    Step(Transition.TRANSITION_CLEANUP, 'cleanup', 'inactive', 'cleaningup', 'unconfigured'),
    Step(Transition.TRANSITION_ACTIVATE, 'activate', 'inactive', 'activating', 'active'),
    Step(Transition.TRANSITION_DEACTIVATE, 'deactivate', 'active', 'deactivating', 'inactive'),
    *(
        Step(number, 'shutdown', start, 'shuttingdown', 'finalized')
        for number, start in (
            (Transition.TRANSITION_UNCONFIGURED_SHUTDOWN, 'unconfigured'),
            (Transition.TRANSITION_INACTIVE_SHUTDOWN, 'inactive'),
            (Transition.TRANSITION_ACTIVE_SHUTDOWN, 'active'),
        )
    ),
)


class Later:
    """The answer to a request that is given when the work is done."""

    def __init__(self) -> None:
        self._send: Callable[[Any], None] | None = None
        self._answer: Any = None

    def to(self, send: Callable[[Any], None]) -> None:
        """Send the answer this way, at once if it is there."""
        self._send = send
        if self._answer is not None:
            send(self._answer)

    def answer(self, response: Any) -> None:
        self._answer = response
        if self._send is not None:
            self._send(response)


class ManagedNode(CellNode):
    """
    Begins at once, or, with ``managed``, when it is configured and activated.

    A transition that cannot be made is refused with a sentence, and the node stays as it was. While
    one is made that takes its time, the node goes on serving all else.
    """

    settings: ClassVar[tuple[Setting, ...]] = (
        Setting(
            'managed',
            False,
            'work only between the transitions activate and deactivate of a managed node',
        ),
    )

    def __init__(self, name: str, **kwargs: Any) -> None:
        super().__init__(name, **kwargs)
        self._state = 'unconfigured'

    @property
    def managed(self) -> bool:
        """Return whether somebody else says when it works."""
        return bool(self.setting('managed'))

    @abstractmethod
    def prepare(self) -> None:
        """Refuse what cannot work."""

    @abstractmethod
    def begin(self) -> None:
        """Begin the work."""

    def wind_down(self, done: Callable[[], None]) -> None:
        """Take in what is under way, and tell when that is done."""
        done()

    @abstractmethod
    def finish(self) -> None:
        """End the work, so that it can begin again."""

    def start(self) -> None:
        """Begin, or offer the transitions; to be called when all else is there."""
        if not self.managed:
            self.begin()
            return
        self._events = self.create_publisher(TransitionEvent, '~/transition_event', 10)
        change = self.create_service(ChangeState, '~/change_state', self._change)
        # Who answers later is told how to by the executor that has the request.
        send = change.send_response

        def send_later(response: Any, header: Any) -> None:
            if isinstance(response, Later):
                response.to(lambda answer: send(answer, header))
            else:
                send(response, header)

        change.send_response = send_later  # type: ignore[method-assign]
        self.create_service(GetState, '~/get_state', self._tell_state)
        self.create_service(GetAvailableStates, '~/get_available_states', self._tell_states)
        for name, start in (('available_transitions', True), ('transition_graph', False)):
            tell = partial(self._tell_transitions, only_now=start)
            self.create_service(GetAvailableTransitions, f'~/get_{name}', tell)
        self._now('unconfigured')

    # Transitions -----------------------------------------------------------------------------

    def _change(
        self, request: ChangeState.Request, response: ChangeState.Response
    ) -> ChangeState.Response | Later:
        """Make a transition; refuse one that the state does not have."""
        asked = request.transition
        step = next(
            (
                step
                for step in STEPS
                if step.start == self._state
                and (step.label == asked.label if asked.label else step.number == asked.id)
            ),
            None,
        )
        if step is None:
            known = {step.number: step.label for step in STEPS}
            name = asked.label or known.get(asked.id, asked.id)
            self.tell_once(f'the transition {name} is refused: the node is {self._state}')
            response.success = False
            return response
        later = Later()
        self._go(step, step.meanwhile)
        if step.start == 'active':
            self.wind_down(lambda: self._end_step(step, later, response))
        else:
            self._end_step(step, later, response)
        return later

    def _end_step(self, step: Step, later: Later, response: ChangeState.Response) -> None:
        """Do what a transition asks for, and answer whether it could be done."""
        action = {'configure': self.prepare, 'activate': self.begin}.get(step.label)
        if step.start == 'active':
            action = self.finish
        try:
            if action is not None:
                action()
        except (TwinError, OSError) as error:
            self.tell_once(str(error))
            self._go(step, step.start)
        else:
            self._go(step, step.goal)
            response.success = True
        later.answer(response)

    def _go(self, step: Step, state: str) -> None:
        event = TransitionEvent(
            timestamp=self.get_clock().now().nanoseconds,
            transition=Transition(id=step.number, label=step.label),
            start_state=_state(self._state),
            goal_state=_state(state),
        )
        self._now(state)
        self._events.publish(event)

    def _now(self, state: str) -> None:
        self._state = self.health.running = state
        if _state(state).id <= State.PRIMARY_STATE_FINALIZED:
            self.get_logger().info(f'{state}, as a managed node')

    # Answers ---------------------------------------------------------------------------------

    def _tell_state(self, _: GetState.Request, response: GetState.Response) -> GetState.Response:
        response.current_state = _state(self._state)
        return response

    def _tell_states(
        self, _: GetAvailableStates.Request, response: GetAvailableStates.Response
    ) -> GetAvailableStates.Response:
        response.available_states = [_state(name) for name in STATES.values()]
        return response

    def _tell_transitions(
        self,
        _: GetAvailableTransitions.Request,
        response: GetAvailableTransitions.Response,
        *,
        only_now: bool,
    ) -> GetAvailableTransitions.Response:
        response.available_transitions = [
            TransitionDescription(
                transition=Transition(id=step.number, label=step.label),
                start_state=_state(step.start),
                goal_state=_state(step.meanwhile),
            )
            for step in STEPS
            if not only_now or step.start == self._state
        ]
        return response


def _state(name: str) -> State:
    number = next(number for number, own in STATES.items() if own == name)
    return State(id=number, label=name)
