# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The marking node: the present joints as a contact, when somebody says that the tool touches."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from std_srvs.srv import Trigger

from weld_twin_core.errors import DataError
from weld_twin_msgs_py.files.csv_text import csv_text
from weld_twin_msgs_py.messages import from_messages
from weld_twin_msgs_py.messages.topics import CONTACT, JOINT_STATES

from .cell_node import CellNode
from .run_node import run
from .settings import Setting

STILL = 2e-4
"""How far a joint may move within `PAUSE` and still stand [rad, m]: a tenth of a millimetre at half a
metre, as far as a hand shakes an arm that is guided."""
PAUSE = 0.3
"""Time over which the arm must have stood [s]; longer, and a hand that holds it gets tired."""


class ContactMarker(CellNode):
    """
    Answers the service ``~/mark``: publishes the contact, and adds a row to a table if told to.

    Set the parameter ``label`` to what is touched now; refuses while the arm moves, or while
    nothing is heard of its joints.
    """

    settings: ClassVar[tuple[Setting, ...]] = (
        Setting('label', 'a', 'what the tool touches now', live=True),
        Setting(
            'max_age',
            1.0,
            'age of the last joint state above which nothing is marked [s]',
            0.05,
            3600.0,
        ),
        Setting('table', '', 'CSV file that every contact is added to; none when empty'),
    )

    def __init__(self, **kwargs: Any) -> None:
        super().__init__('contact_marker', **kwargs)
        self._lately: list[tuple[int, tuple[str, ...], np.ndarray]] = []
        self._marked: dict[str, int] = {}
        self._last = 0
        self._heard = 0.0
        self._contacts = self.offer(CONTACT)
        self.listen(JOINT_STATES, self._on_joints, required=True)
        self.create_service(Trigger, '~/mark', self._mark)

    def time_went_back(self) -> None:
        """Forget the joint states of before."""
        self._lately.clear()

    def _on_joints(self, message: Any) -> None:
        stamp, names = from_messages.stamp_ns(message), tuple(message.name)
        q = from_messages.joint_positions(message, names)
        if self._lately and names != self._lately[-1][1]:
            return  # a gripper of its own on the same topic
        self._lately.append((stamp, names, q))
        self._heard = time.monotonic()
        while stamp - self._lately[0][0] > 2e9 * PAUSE:
            self._lately.pop(0)

    def _mark(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        """Answer with the number of the contact, or why there is none."""
        try:
            stamp, names, q = self._standing()
            label = str(self.setting('label')).strip()
            if not label:
                raise DataError('the parameter label is empty; set it to what the tool touches')
            self._write(label, names, q)
        except DataError as error:
            response.success, response.message = False, str(error)
            return response
        self._contacts.publish(self.messages.contact(stamp, label))
        self._last, count = stamp, self._marked.get(label, 0) + 1
        self._marked[label] = count
        response.success, response.message = True, f'contact {count} of {label!r}'
        return response

    def _standing(self) -> tuple[int, tuple[str, ...], np.ndarray]:
        """Return the last joint state of an arm that stands."""
        if not self._lately:
            raise DataError(f"nothing was heard on '{JOINT_STATES.name}'; is the arm on?")
        newest, age = self._lately[-1], time.monotonic() - self._heard
        if age > self.setting('max_age'):
            raise DataError(
                f"the last joint state on '{JOINT_STATES.name}' is {age:.1f} s old; is the arm "
                'still on?'
            )
        if newest[0] == self._last:
            raise DataError('no joint state has come since the last contact; is the arm still on?')
        if newest[0] - self._lately[0][0] < 1e9 * PAUSE:
            raise DataError(f'joint states are known for less than {PAUSE:g} s; mark again')
        recent = [q for stamp, _, q in self._lately if newest[0] - stamp <= 1e9 * PAUSE]
        if float(np.ptp(recent, axis=0).max()) > STILL:
            raise DataError('the arm moves; hold it still and mark again')
        return newest

    def _write(self, label: str, names: tuple[str, ...], q: np.ndarray) -> None:
        """Add a row to the table, with a header where it is new."""
        if not self.setting('table'):
            return
        path = Path(self.setting('table'))
        try:
            new = not path.exists()
            with path.open('a', encoding='utf-8') as file:
                if new:
                    file.write(csv_text((*names, 'contact'), []))
                file.write(csv_text((*q.tolist(), label), []))
        except OSError as error:
            raise DataError(f"table '{path}' cannot be written: {error.strerror}") from None


def main(args: list[str] | None = None) -> int:
    """Run the node."""
    return run(ContactMarker, args)


if __name__ == '__main__':
    raise SystemExit(main())
