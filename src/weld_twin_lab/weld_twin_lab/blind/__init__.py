# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
The blind check: cases from an independent plant, truths sealed, verdicts scored after the fact.

`make` draws cells, causes and motions, has the plant record them and commits to cases and truths;
`diagnose_cases` sees the recordings alone; `score` checks the commitments and compares.
"""
