# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's shader node trees as the native module's graphs: groups, reroutes and muted nodes resolved, dead ends dropped."""
from .compiler import GENERATED, TANGENTS, UVS, Context, Graph, compile_tree, constant_emission, names_of_attributes, solid_graph

__all__ = ["GENERATED", "TANGENTS", "UVS", "Context", "Graph", "compile_tree", "constant_emission", "names_of_attributes",
           "solid_graph"]
