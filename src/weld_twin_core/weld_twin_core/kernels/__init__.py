# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
The chain for bulk work: the same results as `chain`, prepared once and much faster.

`bulk` takes poses, Jacobians and derivatives by DH values of many joint positions; `draws` takes
many draws of the DH values along one seam; `single` takes one joint position at a time;
`calibration` and `saltelli` build on them. docs/speed.md says what each is worth.
"""
