# SPDX-License-Identifier: GPL-3.0-or-later
"""A stand-in of the native Scene that checks what it is given and remembers it, so that what reads Blender's data can be
tested by itself: `content()` says what a scene holds, apart from handles and order."""
import hashlib

import numpy as np

ALL_RAYS = 63


def plain(value):
    """Arrays by content, everything else as it is; comparable and short."""
    if isinstance(value, np.ndarray):
        return ("array", value.dtype.str, value.shape, hashlib.sha1(np.ascontiguousarray(value).tobytes()).hexdigest())
    if isinstance(value, dict):
        return tuple(sorted((str(key), plain(item)) for key, item in value.items()))
    if isinstance(value, (list, tuple)):
        return tuple(plain(item) for item in value)
    if isinstance(value, bytes):
        return ("bytes", len(value), hashlib.sha1(value).hexdigest())
    if isinstance(value, float):
        return float(np.float32(value))
    return value


class RecordingScene:
    def __init__(self):
        self.next, self.calls = 0, []
        self.images, self.materials, self.meshes, self.instances, self.lights = {}, {}, {}, {}, {}
        self.world = None

    def handle(self, kind):
        self.next += 1
        self.calls.append(kind)
        return self.next

    # images
    def add_image(self, source, *, name, colorspace="sRGB", alpha="straight"):
        handle = self.handle("add_image")
        self.images[handle] = (source, name, colorspace, alpha)
        return handle

    def set_image(self, image, source, *, name, colorspace="sRGB", alpha="straight"):
        assert image in self.images
        self.calls.append("set_image")
        self.images[image] = (source, name, colorspace, alpha)

    def remove_image(self, image):
        self.calls.append("remove_image")
        del self.images[image]

    # materials
    def check_graph(self, graph):
        for index, node in enumerate(graph["nodes"]):
            assert set(node) == {"type", "name", "params", "inputs"}, node
            for name, value in node["inputs"].items():
                assert name == name.lower() and " " not in name, name
                if isinstance(value, tuple) and value and value[0] == "link":
                    assert 0 <= value[1] < index, ("link points forward", node)
                else:
                    assert isinstance(value, float) or (isinstance(value, tuple) and len(value) == 3 and all(
                        isinstance(x, float) for x in value)), (node["type"], name, value)
            image = node["params"].get("image")
            assert image is None or image in self.images
        assert graph["surface"] is None or graph["surface"][0] == "link"

    def add_material(self, graph, **kwargs):
        self.check_graph(graph)
        handle = self.handle("add_material")
        self.materials[handle] = (graph, kwargs)
        return handle

    def set_material(self, material, graph, **kwargs):
        self.check_graph(graph)
        assert material in self.materials
        self.calls.append("set_material")
        self.materials[material] = (graph, kwargs)

    def remove_material(self, material):
        self.calls.append("remove_material")
        assert all(material not in instance["materials"] for instance in self.instances.values()), "still in use"
        del self.materials[material]

    # meshes
    def check_mesh(self, mesh):
        if mesh.get("triangles") is None:
            mesh["triangles"] = mesh["corner_vertices"][mesh["corners"]]
        corners = mesh["triangles"] if mesh["corners"] is None else mesh["corners"]
        assert mesh["triangles"].shape == corners.shape and corners.shape[1] == 3
        assert mesh["positions"].ndim == 2 and mesh["triangles"].max() < len(mesh["positions"]) and mesh["triangles"].min() >= 0
        if mesh.get("corner_normals") is not None:
            assert corners.max() < len(mesh["corner_normals"])
        if mesh.get("vertex_normals") is not None:
            assert len(mesh["vertex_normals"]) == len(mesh["positions"])
        for uv in mesh["uvs"].values():
            assert uv.shape[1] == 2 and corners.max() < len(uv)
        for domain, values in mesh["attributes"].values():
            assert domain in {"vertex", "corner", "face", "mesh"} and values.dtype == np.float32 and values.ndim == 2
        faces = len(mesh["triangles"]) if mesh.get("faces") is None else mesh["faces"].max() + 1
        for name in ("smooth", "materials"):
            assert mesh.get(name) is None or len(mesh[name]) >= faces

    @staticmethod
    def copied(arguments):
        def copy(value):
            if isinstance(value, np.ndarray):
                return value.copy()
            if isinstance(value, dict):
                return {key: (item[0], item[1].copy()) if isinstance(item, tuple) else item.copy() for key, item in value.items()}
            return value
        return {key: copy(value) for key, value in arguments.items()}

    def add_mesh(self, *, name, **arguments):
        self.check_mesh(arguments)
        handle = self.handle("add_mesh")
        self.meshes[handle] = self.copied(arguments)
        return handle

    def set_mesh(self, mesh, **arguments):
        self.calls.append("set_mesh")
        if "triangles" in arguments or "corner_vertices" in arguments:
            self.check_mesh(arguments)
            self.meshes[mesh] = self.copied(arguments)
        else:
            assert len(arguments["positions"]) == len(self.meshes[mesh]["positions"])
            self.calls.append("deform_mesh")
            self.meshes[mesh].update(self.copied(arguments))

    def remove_mesh(self, mesh):
        self.calls.append("remove_mesh")
        assert all(instance["mesh"] != mesh for instance in self.instances.values()), "still in use"
        del self.meshes[mesh]

    # instances
    def add_instances(self, mesh, transforms, *, name, materials=(), randoms=None, **properties):
        assert mesh in self.meshes and all(material in self.materials for material in materials)
        assert transforms.shape[1:] == (4, 4) and transforms.dtype == np.float64
        self.calls.append("add_instances")
        handles = []
        for i, transform in enumerate(transforms):
            self.next += 1
            handles.append(self.next)
            self.instances[self.next] = {"mesh": mesh, "transform": transform.copy(), "materials": tuple(materials),
                                         "name": name, "random": float(randoms[i]), **properties}
        return np.array(handles, np.uint32)

    def set_transforms(self, instances, transforms):
        self.calls.append("set_transforms")
        for handle, transform in zip(instances.tolist(), transforms):
            self.instances[handle]["transform"] = transform.copy()

    def set_instances(self, instances, **properties):
        self.calls.append("set_instances")
        assert all(material in self.materials for material in properties.get("materials", ()))
        for handle in instances.tolist():
            self.instances[handle].update(properties)

    def remove_instances(self, instances):
        self.calls.append("remove_instances")
        for handle in instances.tolist():
            del self.instances[handle]

    # lights, world, camera
    def add_light(self, kind, transform, **arguments):
        handle = self.handle("add_light")
        if arguments.get("graph"):
            self.check_graph(arguments["graph"])
        self.lights[handle] = {"graph": None, "kind": kind, "transform": transform.copy(), **arguments}
        return handle

    def set_light(self, light, **arguments):
        self.calls.append("set_light")
        self.lights[light].update(arguments)

    def remove_light(self, light):
        self.calls.append("remove_light")
        del self.lights[light]

    def set_world(self, graph, **arguments):
        self.calls.append("set_world")
        if graph is not None:
            self.check_graph(graph)
        self.world = (graph, arguments)

    def set_camera(self, kind, transform, *, window, **arguments):
        assert kind in {"perspective", "orthographic", "panorama"} and transform.shape == (4, 4)
        assert len(window) == 4 and window[1] > window[0] and window[3] > window[2], window
        assert np.isfinite(transform).all()
        self.camera = (kind, transform, window, arguments)

    # comparison
    def graph_content(self, graph):
        if graph is None:
            return None
        nodes = []
        for node in graph["nodes"]:
            params = dict(node["params"])
            if params.get("image") is not None:
                params["image"] = plain(self.images[params["image"]])
            nodes.append({**node, "params": params})
        return plain({"nodes": nodes, "surface": graph["surface"]})

    def content(self):
        materials = {handle: (self.graph_content(graph), plain(kwargs)) for handle, (graph, kwargs) in self.materials.items()}
        meshes = {handle: plain({key: value for key, value in mesh.items() if value is not None})
                  for handle, mesh in self.meshes.items()}
        instances = sorted(repr((meshes[i["mesh"]], tuple(materials[m] for m in i["materials"]),
                                 plain({k: v for k, v in i.items() if k not in {"mesh", "materials"}})))
                           for i in self.instances.values())
        lights = sorted(repr((self.graph_content(light["graph"]), plain({k: v for k, v in light.items() if k != "graph"})))
                        for light in self.lights.values())
        return {"images": sorted(repr(plain(image)) for image in self.images.values()),
                "materials": sorted(map(repr, materials.values())), "meshes": sorted(map(repr, meshes.values())),
                "instances": instances, "lights": lights,
                "world": self.world and (self.graph_content(self.world[0]), plain(self.world[1]))}
