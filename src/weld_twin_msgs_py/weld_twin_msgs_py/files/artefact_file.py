# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A YAML file that describes what is touched."""

from pathlib import Path

from weld_twin_core.contacts import Artefact
from weld_twin_core.errors import DataError, ModelError

from .yaml_file import read_yaml


def read_artefact(path: Path | str) -> Artefact:
    """Return the artefact that a YAML file describes; see `Artefact.from_mapping`."""
    entry = read_yaml(path, 'artefact file')
    try:
        return Artefact.from_mapping(entry)
    except DataError as error:
        raise ModelError(f"artefact file '{path}': {error}") from None
