# SPDX-License-Identifier: GPL-3.0-or-later
"""What the panels of the properties editor share."""

import bpy

ENGINES = {"AFTERGLOW"}


class PropertiesPanel:
    """A panel of the properties editor that is shown for Afterglow alone."""

    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "render"
    COMPAT_ENGINES = ENGINES

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return context.engine in cls.COMPAT_ENGINES

    def prepare(self) -> bpy.types.UILayout:
        """The panel's layout as Blender's own panels have it: names left, fields right."""
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        return layout


def wrap(layout: bpy.types.UILayout, text: str, icon: str = "NONE", width: int = 44) -> None:
    """Writes a long sentence over several lines: Blender's labels do not break."""
    import textwrap

    column = layout.column(align=True)
    column.scale_y = 0.8
    for number, line in enumerate(textwrap.wrap(text, width) or [""]):
        column.label(text=line, icon=icon if number == 0 else "BLANK1" if icon != "NONE" else "NONE")


def draw_node_input(
    layout: bpy.types.UILayout, tree: bpy.types.NodeTree | None, kinds: tuple[str, ...], name: str
) -> bool:
    """Draws the input `name` of a node tree's active output, with the nodes behind it; False: there is no such
    output."""
    if tree is None:
        return False
    outputs = [node for node in tree.nodes if node.bl_idname in kinds]
    active = next(
        (node for node in outputs if getattr(node, "is_active_output", False)), outputs[0] if outputs else None
    )
    socket = active.inputs.get(name) if active is not None else None
    if socket is None:
        return False
    layout.template_node_view(tree, active, socket)
    return True
