# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What a topic carried, in the order it came."""

from __future__ import annotations

from typing import Any

import numpy as np

from weld_twin_msgs_py.messages import from_messages


class Tap:
    """Messages of one topic."""

    def __init__(self, topic: str) -> None:
        self.topic = topic
        self.messages: list[Any] = []

    def __len__(self) -> int:
        return len(self.messages)

    @property
    def last(self) -> Any:
        """Return the newest message."""
        return self.messages[-1]

    @property
    def stamps(self) -> np.ndarray:
        """Return the header stamps, int64 [ns]."""
        return np.array(
            [from_messages.stamp_ns(message) for message in self.messages], dtype=np.int64
        )
