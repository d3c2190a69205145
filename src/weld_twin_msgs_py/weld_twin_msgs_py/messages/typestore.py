# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Message definitions of ROS 2 Jazzy, as rosbags carries them, and what marks our own bags."""

from typing import Any

from rosbags.serde import SerdeError
from rosbags.typesys import Stores, get_typestore

TYPES = get_typestore(Stores.ROS2_JAZZY)
PROVENANCE_PREFIX = 'weld_twin/'
"""Of the keys in a bag's ``custom_data`` that are ours."""


def decode(data: bytes, kind: str) -> Any:
    """
    Return the message of serialised bytes.

    Fast CDR aligns for the elements of a sequence even when it is empty, as the effort of many a
    joint state is; so up to seven bytes may trail a message, and rosbags puts up with three.
    """
    try:
        return TYPES.deserialize_cdr(data, kind)
    except SerdeError:
        return TYPES.deserialize_cdr(data[:-4], kind)
