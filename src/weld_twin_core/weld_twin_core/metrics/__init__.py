# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""How far the tool is off: deviation metrics in bulk and running, and those of ISO 9283."""
