# SPDX-License-Identifier: MIT
"""Blender's Cycles with per-block stopping: `python3 -m lull.blender FILE.blend`, or the add-on that `lull` is."""
