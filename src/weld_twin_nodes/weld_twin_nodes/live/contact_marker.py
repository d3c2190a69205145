# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The marking node: the present joints as a contact, when somebody says that the tool touches."""

import csv
import time
from functools import partial
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from weld_twin_core.errors import DataError
from weld_twin_msgs_py.assembly.intake import Forward
from weld_twin_msgs_py.files.csv_text import csv_text, unguarded
from weld_twin_msgs_py.messages import from_messages
from weld_twin_msgs_py.messages.topics import CONTACT, JOINT_STATES

from .cell_node import CellNode
from .robot_settings import JOINT_SETTINGS
from .run_node import run
from .settings import Setting

STILL = 2e-4
"""How far a joint may move within `PAUSE` and still stand [rad, m]: a tenth of a millimetre at half a
metre, as far as a hand shakes an arm that is guided."""
LABEL = 'contact'
"""Column of the table that says what is touched."""
PAUSE = 0.3
"""Time over which the arm must have stood [s]; longer, and a hand that holds it gets tired."""


class Part:
    """The joints of one publisher: where they have been lately, at stamps that go forward."""

    def __init__(self) -> None:
        self._order = Forward()
        self._lately: list[tuple[int, np.ndarray]] = []
        self.heard = 0.0

    def take(self, stamp: int, q: np.ndarray) -> None:
        """Take a sample, at a stamp [ns]."""
        if self._order.restarted_at(stamp):
            self._lately.clear()
        self._lately.append((stamp, q))
        self.heard = time.monotonic()
        while len(self._lately) > 2 and stamp - self._lately[1][0] >= 1e9 * PAUSE:
            self._lately.pop(0)

    @property
    def newest(self) -> tuple[int, np.ndarray]:
        return self._lately[-1]

    @property
    def known(self) -> bool:
        """Return whether it is known for as long as the arm must have stood."""
        return self._lately[-1][0] - self._lately[0][0] >= 1e9 * PAUSE

    @property
    def moves(self) -> np.ndarray:
        """Return of each joint whether it has moved lately."""
        moved: np.ndarray = np.ptp([q for _, q in self._lately], axis=0) > STILL
        return moved


class ContactMarker(CellNode):
    """
    Answers the service ``~/mark``: publishes the contact, and adds a row to a table if told to.

    Refuses while any joint on the topic moves, or while nothing is heard of the joints.
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
        next(item for item in JOINT_SETTINGS if item.name == 'joints_beside'),
    )

    def __init__(self, **kwargs: Any) -> None:
        super().__init__('contact_marker', **kwargs)
        self._parts: dict[tuple[str, ...], Part] = {}
        self._marked: dict[str, int] = {}
        self._last: dict[tuple[str, ...], int] = {}
        self._contacts = self.offer(CONTACT)
        self.listen(JOINT_STATES, self._on_joints, required=True)
        self.answer('~/mark', self._mark)

    def time_went_back(self) -> None:
        """Forget the joint states of before."""
        self._parts.clear()
        self._last.clear()

    def _on_joints(self, message: Any) -> None:
        names = tuple(name for name in message.name if name not in self.carrying_nothing)
        if names:
            q = from_messages.joint_positions(message, names)
            self._parts.setdefault(names, Part()).take(from_messages.stamp_ns(message), q)

    def _mark(self) -> str:
        stamp, joints = self._standing()
        label = str(self.setting('label')).strip()
        if not label:
            raise DataError('the parameter label is empty; set it to what the tool touches')
        self._write(label, joints)
        self._contacts.publish(self.messages.contact(stamp, label))
        self._last = {names: part.newest[0] for names, part in self._parts.items()}
        count = self._marked[label] = self._marked.get(label, 0) + 1
        return f'contact {count} of {label!r}'

    def _standing(self) -> tuple[int, dict[str, float]]:
        """Return the newest stamp and where each joint is, all of which stand, the arm's or not."""
        if not self._parts:
            raise DataError(f"nothing was heard on '{JOINT_STATES.name}'; is the arm on?")
        for names, part in self._parts.items():
            self._refuse_unsure(names, part)
        joints = {
            name: float(value)
            for names, part in self._parts.items()
            for name, value in zip(names, part.newest[1], strict=True)
        }
        return max(part.newest[0] for part in self._parts.values()), joints

    def _refuse_unsure(self, names: tuple[str, ...], part: Part) -> None:
        """Refuse joints that are silent, known too shortly, or on their way."""
        age = time.monotonic() - part.heard
        alone = len(self._parts) == 1
        of = '' if alone else f' of {", ".join(names)}'
        or_beside = '' if alone else ', or should joints_beside name what is none of it'
        if age > self.setting('max_age'):
            raise DataError(
                f"the last joint state{of} on '{JOINT_STATES.name}' is {age:.1f} s old; is the arm "
                f'still on{or_beside}?'
            )
        if part.newest[0] == self._last.get(names):
            raise DataError(
                f'no joint state{of} has come since the last contact; is the arm still on{or_beside}?'
            )
        if not part.known:
            raise DataError(f'joint states{of} are known for less than {PAUSE:g} s; mark again')
        moving = [name for name, moves in zip(names, part.moves, strict=True) if moves]
        if moving:
            raise DataError(
                f'the arm moves ({", ".join(moving)}); hold it still and mark again, or name joints '
                'that do not carry the tool in joints_beside'
            )

    def _write(self, label: str, joints: dict[str, float]) -> None:
        """Add a row to the table, in the order of its header; with a header where it is new."""
        if not self.setting('table'):
            return
        path = Path(self.setting('table'))
        try:
            text = path.read_text(encoding='utf-8') if path.exists() else ''
            header = next(csv.reader([text.partition('\n')[0]]), None) or [*joints, LABEL]
            columns = [unguarded(name) for name in header]
            if sorted(columns) != sorted([*joints, LABEL]):
                raise DataError(
                    f"table '{path}' has the columns {', '.join(columns)}, and the joints are now "
                    f'{", ".join(joints)}; give another table, or name what is none of the arm in '
                    'joints_beside'
                )
            row = {**joints, LABEL: label}
            with path.open('a', encoding='utf-8') as file:
                file.write('' if text else csv_text(columns, []))
                file.write(csv_text([row[name] for name in columns], []))
        except OSError as error:
            raise DataError(f"table '{path}' cannot be written: {error.strerror}") from None


main = partial(run, ContactMarker)


if __name__ == '__main__':
    raise SystemExit(main())
