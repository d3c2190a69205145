# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Putting a growing bag on the disk.

rosbags keeps an open transaction (sqlite3) or up to 1 MiB of messages (mcap) in memory and
offers nothing to part with them before the end, so this reaches into its writers.
"""

from __future__ import annotations

import os
from typing import Any

from rosbags.rosbag2 import Writer


def flush(writer: Writer) -> None:
    """Make everything written so far readable even if this process is killed."""
    storage: Any = writer.storage
    if hasattr(storage, 'close_chunk'):
        if storage.chunk.bio.tell():
            storage.close_chunk()
        storage.bio.flush()
        os.fsync(storage.bio.fileno())
    elif storage is not None:
        storage.conn.commit()
