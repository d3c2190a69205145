# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Message definitions of ROS 2 Jazzy, as rosbags carries them, and what marks our own bags."""

from functools import lru_cache
from typing import Any

from rosbags.serde import SerdeError
from rosbags.typesys import Stores, get_types_from_idl, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

from weld_twin_core.errors import DataError

TYPES = get_typestore(Stores.ROS2_JAZZY)
PROVENANCE_PREFIX = 'weld_twin/'
"""Of the keys in a bag's ``custom_data`` that are ours."""


@lru_cache(maxsize=32)
def types_with(kind: str, definition: str, idl: bool = False) -> Typestore:
    """Return a store of types that knows one more, as a bag defines it."""
    if not definition:
        raise DataError(
            f'the bag does not say what a {kind} is; record it as mcap, which holds the definition'
        )
    store = get_typestore(Stores.ROS2_JAZZY)
    result = get_types_from_idl(definition) if idl else get_types_from_msg(definition, kind)
    store.register(
        {name: fields for name, fields in result.items() if name not in store.fielddefs}
    )
    return store


def decode(data: bytes, kind: str, types: Typestore = TYPES) -> Any:
    """
    Return the message of serialised bytes.

    Fast CDR aligns for the elements of a sequence even when it is empty, as the effort of many a
    joint state is; so up to seven bytes may trail a message, and rosbags puts up with three.
    """
    try:
        return types.deserialize_cdr(data, kind)
    except SerdeError:
        return types.deserialize_cdr(data[:-4], kind)
