# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Bags (mcap and sqlite3, directories and single files) in and out; nothing else opens one."""

from .contents import BagInfo, TopicInfo, bag_info
from .from_bag import read_recording
from .reader import BagReader, provenance
from .rebuild import Recovery, recover
from .to_bag import write_recording
from .writers import BackgroundBag, BagWriter, GrowingBag

__all__ = [
    'BackgroundBag',
    'BagInfo',
    'BagReader',
    'BagWriter',
    'GrowingBag',
    'Recovery',
    'TopicInfo',
    'bag_info',
    'provenance',
    'read_recording',
    'recover',
    'write_recording',
]
