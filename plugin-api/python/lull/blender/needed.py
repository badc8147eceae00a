# SPDX-License-Identifier: MIT
"""The add-on in a Blender whose Python lacks what it needs: one line on the terminal and in the panel, instead of a traceback."""
from __future__ import annotations

import sys

import bpy


class LULL_PT_needed(bpy.types.Panel):
    """In the place of the add-on's own panel."""
    bl_label, bl_space_type, bl_region_type, bl_context = "Lull", "PROPERTIES", "WINDOW", "render"
    text = ""

    def draw(self, _context: bpy.types.Context) -> None:
        """A part a line: the panel is narrow."""
        for part in self.text.split(": "):
            self.layout.label(text=part)


def register(text: str) -> None:
    """Says it."""
    LULL_PT_needed.text = text
    bpy.utils.register_class(LULL_PT_needed)
    print(text, file=sys.stderr, flush=True)


def unregister() -> None:
    """Takes the panel away."""
    bpy.utils.unregister_class(LULL_PT_needed)
