# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Work that a node hands to a thread, and that cannot keep it from its end."""

from collections.abc import Callable
from concurrent.futures import Future
from queue import SimpleQueue
from threading import Thread
from typing import Any


class WorkBeside:
    """
    Does one thing after the other.

    An interpreter that ends waits for pools of `concurrent.futures`, and not for this.
    """

    def __init__(self) -> None:
        self._asked: SimpleQueue[tuple[Future[Any], Callable[..., Any], tuple[Any, ...]]] = (
            SimpleQueue()
        )
        Thread(target=self._work, daemon=True).start()

    def submit(self, action: Callable[..., Any], *args: Any) -> Future[Any]:
        """Have something done after what was asked for before; return what comes of it."""
        done: Future[Any] = Future()
        self._asked.put((done, action, args))
        return done

    def _work(self) -> None:
        while True:
            done, action, args = self._asked.get()
            try:
                done.set_result(action(*args))
            except Exception as error:  # whoever asks for the result has it
                done.set_exception(error)
