# SPDX-License-Identifier: GPL-3.0-or-later
"""The material's tab: slots, preview, the surface's nodes, settings."""

import bpy

from .panel import PropertiesPanel, draw_node_input


class MaterialPanel(PropertiesPanel):
    bl_context = "material"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return context.engine in cls.COMPAT_ENGINES and context.material is not None


class AFTERGLOW_MATERIAL_PT_context(PropertiesPanel, bpy.types.Panel):
    bl_label = ""
    bl_context = "material"
    bl_options = {"HIDE_HEADER"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if context.engine not in cls.COMPAT_ENGINES:
            return False
        return context.material is not None or (context.object is not None and context.object.type != "GPENCIL")

    def draw(self, context: bpy.types.Context) -> None:
        layout, thing, slot, space = self.layout, context.object, context.material_slot, context.space_data
        if thing is not None:
            several = len(thing.material_slots) > 1
            row = layout.row()
            row.template_list(
                "MATERIAL_UL_matslots",
                "",
                thing,
                "material_slots",
                thing,
                "active_material_index",
                rows=5 if several else 3,
            )
            column = row.column(align=True)
            column.operator("object.material_slot_add", icon="ADD", text="")
            column.operator("object.material_slot_remove", icon="REMOVE", text="")
            column.separator()
            column.menu("MATERIAL_MT_context_menu", icon="DOWNARROW_HLT", text="")
            if several:
                column.separator()
                column.operator("object.material_slot_move", icon="TRIA_UP", text="").direction = "UP"
                column.operator("object.material_slot_move", icon="TRIA_DOWN", text="").direction = "DOWN"
            if thing.mode == "EDIT":
                row = layout.row(align=True)
                row.operator("object.material_slot_assign", text="Assign")
                row.operator("object.material_slot_select", text="Select")
                row.operator("object.material_slot_deselect", text="Deselect")
            row = layout.row()
            row.template_ID(thing, "active_material", new="material.new")
            if slot is not None:
                row.prop(
                    slot, "link", text="", icon="OBJECT_DATA" if slot.link == "OBJECT" else "MESH_DATA", icon_only=True
                )
        elif context.material is not None:
            layout.template_ID(space, "pin_id")


class AFTERGLOW_MATERIAL_PT_preview(MaterialPanel, bpy.types.Panel):
    bl_label = "Preview"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: bpy.types.Context) -> None:
        self.layout.template_preview(context.material)


class AFTERGLOW_MATERIAL_PT_surface(MaterialPanel, bpy.types.Panel):
    bl_label = "Surface"

    def draw(self, context: bpy.types.Context) -> None:
        layout, material = self.prepare(), context.material
        if not material.use_nodes:
            layout.prop(material, "use_nodes", icon="NODETREE")
            for name in ("diffuse_color", "metallic", "roughness"):
                layout.prop(material, name)
        elif not draw_node_input(layout, material.node_tree, ("ShaderNodeOutputMaterial",), "Surface"):
            layout.label(text="No output node", icon="INFO")


class AFTERGLOW_MATERIAL_PT_settings(MaterialPanel, bpy.types.Panel):
    bl_label = "Settings"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: bpy.types.Context) -> None:
        layout, material = self.prepare(), context.material
        layout.prop(material, "pass_index")
        layout.prop(material, "use_backface_culling")
        cycles = getattr(material, "cycles", None)
        for name in ("emission_sampling", "sample_as_light"):
            if cycles is not None and hasattr(cycles, name):
                layout.prop(cycles, name)
                break


classes = (
    AFTERGLOW_MATERIAL_PT_context,
    AFTERGLOW_MATERIAL_PT_preview,
    AFTERGLOW_MATERIAL_PT_surface,
    AFTERGLOW_MATERIAL_PT_settings,
)
