# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
The chain for special work: the same results as `arm.chain`, prepared once and much faster.

`draws` takes many draws of the DH values along one seam; `single_pose` takes one joint position
at a time; `saltelli` has the design and the estimators of Sobol's indices. Many joint positions at
once are the work of `arm.bulk`. docs/speed.md says what each is worth.
"""
