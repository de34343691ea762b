# SPDX-License-Identifier: GPL-3.0-or-later
"""Inside Blender: after every one of many random edits, what was synced step by step equals a fresh sync.

Arguments after --: seed, number of edits."""
import os
import random
import sys

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import bpy
from recording_scene import RecordingScene
from sync_tools import finish, load_sync

sync = load_sync()
seed, edits = (int(x) for x in sys.argv[sys.argv.index("--") + 1:])
dice = random.Random(seed)
bpy.ops.wm.read_factory_settings(use_empty=True)
scene = bpy.context.scene


def add(data, name, collection=None):
    ob = bpy.data.objects.new(name, data)
    (collection or scene.collection).objects.link(ob)
    ob.location = [dice.uniform(-5, 5) for _ in range(3)]
    return ob


def mesh(name, size=1.0):
    data = bpy.data.meshes.new(name)
    data.from_pydata([(x * size, y * size, z * size) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], [],
                     [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)])
    data.uv_layers.new(name="UVMap")
    data.color_attributes.new("paint", "BYTE_COLOR", "CORNER").data[3].color = (0.1, 0.4, 0.9, 1.0)
    return data


def material(name):
    result = bpy.data.materials.new(name)
    result.use_nodes = True
    return result


def build():
    shared = mesh("shared")
    mats = [material(f"m{i}") for i in range(4)]
    for i in range(3):
        add(shared, f"shared{i}")
    shared.materials.append(mats[0])
    changed = add(shared, "modified")
    changed.modifiers.new("array", "ARRAY").count = 3
    slotted = add(mesh("slotted"), "slotted")
    for i in range(3):
        slotted.data.materials.append(mats[i] if i else None)
    slotted.data.polygons[2].material_index = 2
    curve = bpy.data.curves.new("curve", "CURVE")
    curve.dimensions, curve.bevel_depth = "3D", 0.1
    curve.splines.new("BEZIER").bezier_points.add(2)
    add(curve, "curve")
    text = bpy.data.curves.new("text", "FONT")
    text.body = "glow"
    add(text, "text")
    ball = bpy.data.metaballs.new("ball")
    ball.elements.new()
    add(ball, "ball")
    inner = bpy.data.collections.new("inner")
    add(mesh("inside", 0.3), "inside", inner)
    add(bpy.data.lights.new("inside lamp", "POINT"), "inside lamp", inner)
    for i in range(2):
        empty = add(None, f"empty{i}")
        empty.instance_type, empty.instance_collection = "COLLECTION", inner
    points = bpy.data.meshes.new("points")
    points.from_pydata([(i % 5, i // 5, 2) for i in range(20)], [], [])
    parent = add(points, "parent")
    parent.instance_type = "VERTS"
    add(mesh("child", 0.1), "child").parent = parent
    for kind in ("POINT", "SUN", "SPOT", "AREA"):
        add(bpy.data.lights.new(kind, kind), kind)
    scene.world = bpy.data.worlds.new("world")
    scene.camera = add(bpy.data.cameras.new("camera"), "camera")


def some(kind=None):
    return dice.choice([ob for ob in scene.objects if kind is None or ob.type in kind])


def nodes_of(mat):
    return mat.node_tree.nodes


def edit_move():
    ob = some()
    ob.location.x += dice.uniform(-1, 1)
    return ob.name


def edit_scale():
    some({"MESH", "LIGHT"}).scale = [dice.uniform(0.5, 2)] * 3


def edit_vertex():
    data = dice.choice([m for m in bpy.data.meshes if m.users and len(m.vertices)])
    data.vertices[0].co.z += 0.25
    data.update()
    return data.name


def edit_curve():
    bpy.data.curves["curve"].bevel_depth = dice.uniform(0.05, 0.3)


def edit_text():
    bpy.data.curves["text"].body = dice.choice(["glow", "after", "x" * dice.randint(1, 5), ""])


def edit_ball():
    bpy.data.metaballs["ball"].elements[0].radius = dice.uniform(0.5, 2)


def edit_color():
    mat = dice.choice(list(bpy.data.materials))
    for node in nodes_of(mat):
        if node.bl_idname == "ShaderNodeBsdfPrincipled":
            node.inputs["Base Color"].default_value = (dice.random(), 0.5, 0.5, 1)


def edit_attribute():
    mat = dice.choice(list(bpy.data.materials))
    nodes, links = nodes_of(mat), mat.node_tree.links
    found = [n for n in nodes if n.bl_idname == "ShaderNodeVertexColor"]
    if found:
        nodes.remove(found[0])
    else:
        node = nodes.new("ShaderNodeVertexColor")
        node.layer_name = dice.choice(["paint", ""])
        links.new(node.outputs["Color"], next(n for n in nodes if n.bl_idname == "ShaderNodeBsdfPrincipled").inputs["Base Color"])
    return mat.name


def edit_slot():
    ob = some({"MESH"})
    if ob.data.materials:
        index = dice.randrange(len(ob.data.materials))
        if dice.random() < 0.5:
            ob.material_slots[index].link = dice.choice(["DATA", "OBJECT"])
        ob.material_slots[index].material = dice.choice([None, *bpy.data.materials])
    else:
        ob.data.materials.append(dice.choice(list(bpy.data.materials)))


def edit_light():
    lamp = dice.choice(list(bpy.data.lights))
    lamp.energy = dice.uniform(1, 100)
    if dice.random() < 0.3:
        lamp.type = dice.choice(["POINT", "SUN", "SPOT", "AREA"])


def edit_world():
    scene.world.color = (dice.random(), 0, 0)
    scene.world.use_nodes = dice.random() < 0.5
    if dice.random() < 0.2:
        scene.world = bpy.data.worlds[0] if scene.world is None else scene.world


def edit_visibility():
    ob = some({"MESH", "LIGHT"})
    setattr(ob, dice.choice(["visible_camera", "visible_shadow", "is_holdout", "is_shadow_catcher"]), dice.random() < 0.5)


def edit_hide():
    ob = some()
    ob.hide_viewport = not ob.hide_viewport
    return ob.name


def edit_layer():
    layers = bpy.context.view_layer.layer_collection.children
    if not layers:
        scene.collection.children.link(bpy.data.collections["inner"])
    else:
        setattr(layers[0], dice.choice(["holdout", "indirect_only", "exclude", "hide_viewport"]), dice.random() < 0.5)


def edit_index():
    ob = some()
    ob.pass_index, ob.color = dice.randrange(5), (dice.random(), 1, 1, 1)


def edit_add():
    data = dice.choice([m for m in bpy.data.meshes if m.users])
    return add(data if dice.random() < 0.5 else mesh("new"), "new").name


def edit_remove():
    if len(scene.objects) > 12:
        ob = some({"MESH", "LIGHT", "EMPTY"})
        name = ob.name
        bpy.data.objects.remove(ob)
        return name
    return None


def edit_modifier():
    ob = some({"MESH"})
    if ob.modifiers:
        ob.modifiers.clear()
    else:
        ob.modifiers.new("solid", "SOLIDIFY").thickness = dice.uniform(0.1, 0.3)
    return ob.name


def edit_instances():
    ob = some({"EMPTY", "MESH"})
    if ob.type == "EMPTY":
        ob.instance_type = dice.choice(["NONE", "COLLECTION"])
    return ob.name


def edit_points():
    data = bpy.data.meshes["points"]
    data.clear_geometry()
    data.from_pydata([(i, 0, 2) for i in range(dice.randint(0, 12))], [], [])
    data.update()


def edit_override():
    bpy.context.view_layer.material_override = dice.choice([None, None, *bpy.data.materials])


def edit_image():
    mat = dice.choice(list(bpy.data.materials))
    image = bpy.data.images.get("made") or bpy.data.images.new("made", 4, 4)
    nodes = nodes_of(mat)
    found = [n for n in nodes if n.bl_idname == "ShaderNodeTexImage"]
    if found:
        nodes.remove(found[0])
    else:
        node = nodes.new("ShaderNodeTexImage")
        node.image = image
        target = next(n for n in nodes if n.bl_idname == "ShaderNodeBsdfPrincipled")
        mat.node_tree.links.new(node.outputs["Color"], target.inputs["Roughness"])


def edit_material_remove():
    if len(bpy.data.materials) > 3:
        bpy.data.materials.remove(dice.choice(list(bpy.data.materials)))
    else:
        material("again")


EDITS = [function for name, function in sorted(globals().items()) if name.startswith("edit_")]
recorded = RecordingScene()
keeper = sync.SceneSync(recorded)
state = {"syncs": 0, "last": []}


def compare(depsgraph, what):
    fresh = RecordingScene()
    sync.SceneSync(fresh).sync(depsgraph)
    one, two = recorded.content(), fresh.content()
    for key in two:
        if one[key] != two[key]:
            print("DIFFERENCE", key, what)
            for side, a, b in (("incremental", one[key], two[key]), ("fresh", two[key], one[key])):
                print(side, [x for x in a if x not in b] if isinstance(a, list) else a)
            raise AssertionError(f"{key} differs after {what}")


def on_update(changed_scene, depsgraph):
    state["syncs"] += 1
    state["last"] = [(u.id.name, u.is_updated_geometry, u.is_updated_transform, u.is_updated_shading) for u in depsgraph.updates]
    keeper.sync(depsgraph)


def run():
    build()
    bpy.app.handlers.depsgraph_update_post.append(on_update)
    bpy.context.view_layer.update()
    if not state["syncs"]:
        keeper.sync(bpy.context.evaluated_depsgraph_get())
    compare(bpy.context.evaluated_depsgraph_get(), "start")
    for step in range(edits):
        function = dice.choice(EDITS)
        said = function()
        bpy.context.view_layer.update()
        compare(bpy.context.evaluated_depsgraph_get(), f"edit {step}: {function.__name__} {said}; {state['last']}")
    calls = {name: recorded.calls.count(name) for name in sorted(set(recorded.calls))}
    return {"edits": edits, "syncs": state["syncs"], "calls": calls}


finish(run)
