# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A corrected model, a robot program, a policy, a schema.

'weld-twin export found/diagnosis.json' alone writes the model.
"""

JOBS = ('model', 'program', 'policy', 'schema')
USUAL = 'model'
"""The job that is meant where none is named."""
EXAMPLE = 'weld-twin export found/diagnosis.json --robot ur5 --format urdf --out better.urdf'
