# SPDX-License-Identifier: GPL-3.0-or-later
"""Walks a node tree from its active output towards its sources and writes down what it meets, once each.

A node group has no node of its own in the graph: its sockets are looked through, with the stack of groups as part of a
node's identity, so that a group used twice gives two sets of nodes. What each node type means is in `rules.py`.
"""
from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any

Value = float | tuple[float, ...]
Link = tuple[str, int, str]
Source = Value | Link | None
Graph = dict[str, Any]

MAX_DEPTH = 64  # groups within groups; Blender forbids recursion, a broken file may not


@dataclass
class Context:
    """What a tree needs from outside: image(image, image_user, material) → handle or None, warn(text), matrix(object) → world to
    the object as rows of floats, the owner's name for warnings."""

    image: Callable[[Any, Any], int | None]
    warn: Callable[[str], None]
    matrix: Callable[[Any], Any]
    owner: str = ""
    # attribute("OBJECT" | "INSTANCER" | "VIEW_LAYER", name) → four floats, or None where there is no such property
    attribute: Callable[[str, str], tuple[float, ...] | None] = lambda kind, name: None
    version: tuple[int, ...] = (5, 0, 0)
    said: set[str] = field(default_factory=set)

    def warn_once(self, text: str) -> None:
        if text not in self.said:
            self.said.add(text)
            self.warn(f"{self.owner}: {text}")


def snake(name: str) -> str:
    return re.sub(r"[^a-z0-9]+", "_", name.lower()).strip("_")


def is_link(value: Any) -> bool:
    return isinstance(value, tuple) and len(value) == 3 and value[0] == "link"


def to_float(value: Value) -> float:
    """A colour's luminance, as Blender converts (a vector's mean is handled where the socket's kind is known)."""
    if isinstance(value, tuple):
        return 0.2126729 * value[0] + 0.7151522 * value[1] + 0.0721750 * value[2]
    return value


def to_triple(value: Value) -> tuple[float, ...]:
    return value if isinstance(value, tuple) else (value, value, value)


def constant_of(socket: Any) -> Value | None:
    """An unlinked socket's own value; None where it has none or stands for the shading point's (normal, coordinates)."""
    kind = socket.type
    if kind == "VALUE":
        return float(socket.default_value)
    if kind in {"INT", "BOOLEAN"}:
        return float(socket.default_value)
    if kind == "RGBA":
        return tuple(socket.default_value)[:3]
    if kind in {"VECTOR", "ROTATION"} and not socket.hide_value:
        return tuple(socket.default_value)[:3]
    return None


def converted(value: Value | None, source: str, target: str) -> Value | None:
    """A constant as a socket of another kind sees it."""
    if value is None or source == target:
        return value
    if target in {"VALUE", "INT", "BOOLEAN"} and isinstance(value, tuple):
        return sum(value) / 3.0 if source == "VECTOR" else to_float(value)
    if target in {"RGBA", "VECTOR"} and not isinstance(value, tuple):
        return to_triple(value)
    return value


class Compiler:
    """One tree's walk. `nodes` grows; `inputs` of each are resolved before it is appended, so links never point forward."""

    def __init__(self, context: Context) -> None:
        self.context = context
        self.nodes: list[dict[str, Any]] = []
        self.seen: dict[Any, Any] = {}
        self.links: dict[int, dict[int, Any]] = {}
        self.open: set[Any] = set()
        self.normal: Source = None  # what an unlinked Normal input stands for; set where displacement acts as a bump

    # -- building blocks for rules

    def add(self, kind: str, name: str = "", inputs: dict[str, Source] | None = None, /, **params: Any) -> int:
        given = {key: value for key, value in (inputs or {}).items() if value is not None}
        self.nodes.append({"type": kind, "name": name, "params": params, "inputs": given})
        return len(self.nodes) - 1

    def link(self, output: str, kind: str, name: str = "", inputs: dict[str, Source] | None = None, /, **params: Any) -> Link:
        return ("link", self.add(kind, name, inputs, **params), output)

    def math(self, operation: str, a: Source, b: Source = 0.0) -> Source:
        return self.link("value", "math", "", {"value": a, "value_001": b}, operation=operation, clamp=False)

    # -- resolving sockets

    def tree_links(self, tree: Any) -> dict[int, Any]:
        key = tree.as_pointer()
        if key not in self.links:
            self.links[key] = {link.to_socket.as_pointer(): link for link in tree.links
                               if not getattr(link, "is_muted", False) and link.is_valid}
        return self.links[key]

    def source(self, socket: Any, stack: tuple[Any, ...]) -> Source:
        """What an input socket gets: a constant, a link into `nodes`, or None for the type's default."""
        link = self.tree_links(socket.id_data).get(socket.as_pointer())
        if link is None:
            return constant_of(socket)
        found, kind = self.follow(link.from_node, link.from_socket, stack)
        return found if is_link(found) else converted(found, kind, socket.type)

    def as_float(self, link: Link) -> Source:
        return self.math("add", link)

    def through(self, found: Source, kind: str, socket: Any) -> tuple[Source, str]:
        """A value that passes a group's socket takes that socket's kind."""
        if is_link(found):
            if socket.type == "VALUE" and kind in {"RGBA", "VECTOR"}:
                return self.as_float(found), "VALUE"
            return found, kind if socket.type == "SHADER" else socket.type
        return converted(found, kind, socket.type), socket.type

    def follow(self, node: Any, socket: Any, stack: tuple[Any, ...]) -> tuple[Source, str]:
        """What an output socket gives, looking through reroutes, muted nodes and groups; and its kind."""
        if len(stack) > MAX_DEPTH:
            return None, socket.type
        kind = node.bl_idname
        if kind == "NodeReroute":
            return self.input_of(node.inputs[0], stack)
        if node.mute and kind not in {"NodeGroupInput", "NodeGroupOutput"}:
            for inner in node.internal_links:
                if inner.to_socket == socket:
                    return self.input_of(inner.from_socket, stack)
            return None, socket.type
        if kind == "NodeGroupInput":
            if not stack:
                return constant_of(socket), socket.type
            owner = next((s for s in stack[-1].inputs if s.identifier == socket.identifier), None)
            return self.through(*self.input_of(owner, stack[:-1]), owner) if owner is not None else (None, socket.type)
        if node.type == "GROUP":
            output = group_output(node.node_tree)
            inner = next((s for s in output.inputs if s.identifier == socket.identifier), None) if output else None
            return self.through(*self.input_of(inner, (*stack, node)), inner) if inner is not None else (None, socket.type)
        return self.visit(node, socket, stack), socket.type

    def input_of(self, socket: Any, stack: tuple[Any, ...]) -> tuple[Source, str]:
        link = self.tree_links(socket.id_data).get(socket.as_pointer())
        if link is None:
            return constant_of(socket), socket.type
        return self.follow(link.from_node, link.from_socket, stack)

    def visit(self, node: Any, socket: Any, stack: tuple[Any, ...]) -> Source:
        """The graph's value of a node's output, made when first asked for."""
        from .rules import translate
        key = (node.as_pointer(), tuple(group.as_pointer() for group in stack))
        if key in self.open:
            self.context.warn_once(f"node '{node.name}' depends on itself: the loop is cut")
            return None
        if key not in self.seen:
            self.open.add(key)
            self.seen[key] = translate(self, NodeView(self, node, stack))
            self.open.discard(key)
        outputs = self.seen[key]
        return outputs(socket) if callable(outputs) else outputs.get(socket.identifier)


def group_output(tree: Any) -> Any:
    if tree is None:
        return None
    outputs = [node for node in tree.nodes if node.bl_idname == "NodeGroupOutput"]
    return next((node for node in outputs if node.is_active_output), outputs[0] if outputs else None)


class NodeView:
    """A node as its rule sees it: inputs by identifier, resolved when asked for."""

    def __init__(self, compiler: Compiler, node: Any, stack: tuple[Any, ...]) -> None:
        self.compiler, self.node, self.stack = compiler, node, stack
        self.sockets = {socket.identifier: socket for socket in node.inputs}

    def has(self, identifier: str) -> bool:
        return identifier in self.sockets

    def linked(self, identifier: str) -> bool:
        socket = self.sockets.get(identifier)
        return socket is not None and socket.as_pointer() in self.compiler.tree_links(socket.id_data)

    def output_linked(self, identifier: str) -> bool:
        return any(socket.identifier == identifier and socket.is_linked for socket in self.node.outputs)

    def input(self, *identifiers: str) -> Source:
        """The first of the named inputs that this version of the node has."""
        for identifier in identifiers:
            if identifier in self.sockets:
                value = self.compiler.source(self.sockets[identifier], self.stack)
                if value is None and identifier in {"Normal", "Coat Normal", "Clearcoat Normal"}:
                    return self.compiler.normal
                return value
        return None

    def inputs(self) -> Iterator[tuple[str, Source]]:
        for identifier in self.sockets:
            if not getattr(self.sockets[identifier], "is_unavailable", False):
                yield identifier, self.input(identifier)


def active_output(tree: Any, kinds: tuple[str, ...]) -> Any:
    """The output node that counts for Cycles: the active one for 'CYCLES' before that for 'ALL'."""
    outputs = [node for node in tree.nodes if node.bl_idname in kinds]
    for target in ("CYCLES", "ALL"):
        matching = [node for node in outputs if getattr(node, "target", "ALL") == target]
        found = next((node for node in matching if node.is_active_output), matching[0] if matching else None)
        if found is not None:
            return found
    return None


OUTPUTS = {"material": ("ShaderNodeOutputMaterial",), "world": ("ShaderNodeOutputWorld",), "light": ("ShaderNodeOutputLight",)}


def compile_tree(tree: Any, target: str, context: Context) -> Graph:
    """The graph of a material's, world's or light's tree; surface None where nothing reaches the output."""
    compiler = Compiler(context)
    output = active_output(tree, OUTPUTS[target])
    if output is None or output.mute:
        return {"nodes": [], "surface": None}
    view = NodeView(compiler, output, ())
    volume = target in {"material", "world"} and view.linked("Volume")
    if volume:
        context.warn_once("volumes are not supported yet: left out")
    if target == "material" and view.linked("Displacement"):
        compiler.normal = displacement_as_bump(compiler, view)
    surface = as_shader(compiler, view.input("Surface")) if view.linked("Surface") else None
    if surface is None and volume and target == "material":  # nothing but a volume: one looks through its hull
        surface = compiler.link("shader", "transparent_bsdf", inputs={"color": (1.0, 1.0, 1.0)})
    return {"nodes": compiler.nodes, "surface": surface}


def as_shader(compiler: Compiler, value: Source) -> Source:
    """A constant that reaches a shader socket through groups is an emission."""
    if value is None or is_link(value):
        return value
    return compiler.link("shader", "emission", inputs={"color": to_triple(value), "strength": 1.0})


def displacement_as_bump(compiler: Compiler, view: NodeView) -> Source:
    """Cycles' own way with a material set to bump only: the displacement's height bends the normals."""
    compiler.context.warn_once("displacement is not supported yet: shown as a bump")
    value = view.input("Displacement")
    if not is_link(value):
        return None
    node = compiler.nodes[value[1]]
    if node["type"] != "displacement":
        return None
    inputs = node["inputs"]
    height, scale = inputs.get("height", 0.0), inputs.get("scale", 1.0)
    if not is_link(height):
        return None
    return compiler.link("normal", "bump", "Displacement", {"strength": 1.0, "distance": 1.0,
                                                            "height": compiler.math("multiply", height, scale)}, invert=False)


def constant_emission(graph: Graph) -> tuple[float, float, float] | None:
    """Colour times strength of a graph that is one constant emission; black for an empty one; None: it must be evaluated."""
    surface = graph["surface"]
    if surface is None:
        return (0.0, 0.0, 0.0)
    node = graph["nodes"][surface[1]]
    color, strength = node["inputs"].get("color", (1.0, 1.0, 1.0)), node["inputs"].get("strength", 1.0)
    if node["type"] != "emission" or is_link(color) or is_link(strength):
        return None
    red, green, blue = to_triple(color)[:3]
    return (red * strength, green * strength, blue * strength)


GENERATED = "generated"  # the name under which a mesh carries coordinates of its undeformed shape
TANGENTS = "tangents of "  # before a UV map's name ("": the active one): under which a mesh carries tangents for normal maps

UVS = "uv maps"  # the name under which a mesh is asked for all of its UV maps
# nodes that may look at UV maps, by name or by habit; every texture may, too
READS_UVS = {"texture_coordinate", "uv_map", "normal_map", "tangent", "attribute", "color_attribute"}


def names_of_attributes(graph: Graph) -> set[str]:
    """Names of the mesh attributes that a graph asks for; "" is the active colour, UVS all UV maps."""
    names = set()
    for node in graph["nodes"]:
        kind, params = node["type"], node["params"]
        if kind == "color_attribute" or (kind == "attribute" and params["kind"] == "geometry" and params["name"]):
            names.add(params["name"])
        if kind == "normal_map" and params.get("space", "tangent") == "tangent":
            names.add(TANGENTS + params.get("uv_map", ""))
        if any(is_link(value) and value[2] == GENERATED for value in node["inputs"].values()) or reads_generated(node):
            names.add(GENERATED)
        if kind in READS_UVS or kind.endswith("_texture"):
            names.add(UVS)
    return names


def reads_generated(node: dict[str, Any]) -> bool:
    """Textures without coordinates take generated ones, flat images UVs; radial tangents turn around them."""
    if node["type"] == "tangent":
        return node["params"]["direction_type"] == "radial"
    return node["type"].endswith("_texture") and "vector" not in node["inputs"] and node["params"].get("projection") != "flat"


def solid_graph(kind: str, color: tuple[float, ...], **inputs: Value) -> Graph:
    """A graph of one closure."""
    node = {"type": kind, "name": "", "params": {}, "inputs": {"color": tuple(color)[:3], **inputs}}
    return {"nodes": [node], "surface": ("link", 0, "shader")}
