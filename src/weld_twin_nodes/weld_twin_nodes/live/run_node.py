# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Running a node as a program: one loop that Ctrl-C and SIGTERM always end."""

import atexit
import gc
import re
import signal
import sys
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import rclpy
from rclpy.exceptions import (
    InvalidParameterTypeException,
    InvalidParameterValueException,
    ROSInterruptException,
)
from rclpy.executors import Executor, ExternalShutdownException, SingleThreadedExecutor
from rclpy.signals import SignalHandlerOptions
from rclpy.task import Future

from weld_twin_core.errors import ModelError, TwinError

from .cell_node import CellNode
from .settings import usage

USAGE_ERROR = 2
"""Exit code of a command that was given something wrong."""
HELP = ('--help', '-h')
LOOP = 0.25
"""Seconds of one turn of the loop; also how late an end may be noticed."""


def executor(name: str = 'events') -> Executor:
    """Return what serves a node: the events executor costs a third of the other per message."""
    if name == 'events':
        with suppress(ImportError):  # it came with an update of Jazzy
            from rclpy.experimental import EventsExecutor

            return EventsExecutor()
    return SingleThreadedExecutor()


class Ended(BaseException):
    """
    The second wish to end, before there is a node that could meet the first.

    An interpreter that a KeyboardInterrupt has met within ``exec`` of text, as dataclasses are
    made, kills itself at its end, however that was handled.
    """


class Stop:
    """
    Ctrl-C and SIGTERM as a wish that the node meets in its own time.

    rclpy would close ROS under the node, and what has reached the process but not the node would
    be lost. A node that is being made is finished first: half of one would leave half a bag, or
    threads of the middleware that keep the program alive. Who tells it again will not wait for that.
    """

    def __init__(self) -> None:
        self.wished = False
        self.node: CellNode | None = None
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, self._take)
            # An ending interpreter takes its handlers back, and a second wish would kill it.
            atexit.register(signal.signal, number, signal.SIG_IGN)

    def _take(self, *_: object) -> None:
        again, self.wished = self.wished, True
        if again and self.node is None:
            raise Ended


def spin(node: CellNode, stop: Stop) -> None:
    """
    Serve callbacks until the node is finished or ROS shuts down.

    The events executor can hang in an endless `spin`, and an idle one can miss SIGTERM; turns of
    bounded length do neither.
    """
    runner = executor(node.setting('executor'))
    runner.add_node(node)
    ending = False
    try:
        while rclpy.ok() and not node.finished:
            if stop.wished and not ending:
                ending = True
                node.end()
            elif isinstance(runner, SingleThreadedExecutor):
                # Its wait for a future begins anew every time, and always with the work under way.
                runner.spin_once(timeout_sec=LOOP)
            else:
                runner.spin_until_future_complete(Future(), timeout_sec=LOOP)
    finally:
        runner.shutdown()


def run(make: Callable[[], CellNode], args: list[str] | None = None) -> int:
    """Run a node until it is done or stopped, or print what it takes; return the exit code."""
    words = sys.argv[1:] if args is None else args
    if any(word in HELP for word in words):
        file = sys.modules[make.__module__].__file__ or 'node'
        print(usage(make, Path(file).stem))
        return 0
    stop = Stop()
    node = None
    try:
        _open(args)
        node = stop.node = _made(make)
        gc.freeze()  # what has been loaded stays; looking through it again is a pause of the node
        spin(node, stop)
    except (Ended, ExternalShutdownException, ROSInterruptException):
        pass
    except (
        TwinError,
        OSError,
        InvalidParameterValueException,
        InvalidParameterTypeException,
    ) as error:
        return _reported(error)
    except Exception:
        if rclpy.ok():
            raise
        # A callback was publishing when something closed ROS under it.
    finally:
        if node is not None:
            node.destroy_node()
        rclpy.try_shutdown()
    return 0 if node is None or node.failure is None else _reported(node.failure)


SECURITY = 'security'
"""Word of the errors of rcl and of the middleware that are about keys."""
UNLOCKED = (
    'the node does not run unprotected under ROS_SECURITY_ENABLE; give it an enclave of the '
    'keystore, and a middleware that is built with DDS security'
)
"""What to do where a node may run secured only, and cannot."""
QUOTED = (
    'a list or a mapping is given as text, in two kinds of quotes: '
    '-p \'effects:="[{effect: backlash, joint: elbow_joint, width: 5e-4}]"\''
)
"""What to do where ROS could not read a list after ``-p``."""


def _open(args: list[str] | None) -> None:
    """Open ROS; raise a sentence where it cannot read the arguments."""
    try:
        rclpy.init(args=args, signal_handler_options=SignalHandlerOptions.NO)
    except RuntimeError as error:  # rclpy's own error of it has no public name
        said = str(error).partition(', at /')[0]
        given = re.search(r"'((?:-p|--param|--params-file) .*?)'\. Error", said, re.S)
        if given is None:
            safe = f'; {UNLOCKED}' if SECURITY in said.lower() else ''
            raise ModelError(f'{" ".join(said.split()).rstrip(".")}{safe}') from None
        hint = 'a parameter is given as -p NAME:=VALUE'
        if given[1].startswith('--params-file'):
            hint = 'is there such a YAML file?'
        elif re.search(r':=\s*[\[{]', given[1]):
            hint = QUOTED
        raise ModelError(f'ROS cannot read {given[1]}; {hint}') from None


def _made(make: Callable[[], CellNode]) -> CellNode:
    """Return the node; raise a sentence where the middleware cannot keep it as safe as it must be."""
    try:
        return make()
    except RuntimeError as error:  # rclpy's own error of it has no public name
        said = ' '.join(str(error).partition(', at /')[0].split())
        if SECURITY not in said.lower():
            raise
        raise ModelError(f'{said}; {UNLOCKED}') from None


def _reported(error: Exception) -> int:
    print(f'weld_twin: {error}', file=sys.stderr)
    return USAGE_ERROR
