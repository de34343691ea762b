# SPDX-License-Identifier: GPL-3.0-or-later
"""The native module's border: handles, numpy arrays and typed exceptions. No Blender word is known below this line.

Light is scene-linear Rec. 709, lengths scene units, angles radians, times seconds. Handles are integers that are never
reused within a scene. Arrays are read during the call and may be strided; they are copied in unless said otherwise.
Every call that works longer than a millisecond frees the GIL.
"""
from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypedDict

import numpy as np
from numpy.typing import NDArray

__version__: str

class Error(Exception): ...                 # base of all; text says what is wrong, with which object, how to mend it
class InvalidInput(Error, ValueError): ...  # a wrong argument: shape, type, range, unknown name
class InvalidHandle(Error, KeyError): ...   # no such mesh, material, …
class FileError(Error, OSError): ...        # a file that cannot be read or written
class Unsupported(Error): ...               # what this build or this host cannot do
class OutOfMemory(Error, MemoryError): ...
class Cancelled(Error): ...

# --------------------------------------------------------------------------------------------------------------------
# Node graphs: what a material, a world or a light is made of.
#
# A graph is {"nodes": [node, …], "surface": link | None}. Nodes stand in any order; links must not form a cycle.
# node  = {"type": str, "name": str, "params": {…}, "inputs": {input_name: value | link}}
# value = float | (r, g, b) | (x, y, z)          link = ("link", node_index, "output_name")
# A missing input takes the default written beside it. Closures are nodes, too; "surface" links to a closure output
# ("shader"). Implicit conversions are Blender's: colour → float is Rec. 709 luminance, vector → float the mean, float →
# colour/vector replicates, colour ↔ vector keeps components, a colour linked to a shader input is an emission of strength 1.
# An unknown type raises nothing: its outputs are taken as their inputs' or grey 0.8, and Changes.warnings names it once.
# Output names are in brackets. Input and output names are Blender 4.x/5.x socket names in snake case.
#
# principled  [shader] base_color metallic roughness ior alpha normal diffuse_roughness specular_ior_level specular_tint
#             anisotropic anisotropic_rotation tangent transmission_weight coat_weight coat_roughness coat_ior coat_tint
#             coat_normal sheen_weight sheen_roughness sheen_tint emission_color emission_strength subsurface_weight
#             params: distribution "ggx" | "multi_ggx"; version 1 (Blender < 4.0: no layering by albedo, specular_ior_level
#             holds "Specular", specular_tint and sheen_tint floats, transmission_roughness) or 2
#             Every shader node takes the param version: 1 what it meant before Blender 4.0 (diffuse: 4.3), 2 (default) since.
# diffuse_bsdf [shader] color roughness normal            glossy_bsdf [shader] color roughness anisotropy rotation normal
#             params: distribution "ggx" | "multi_ggx" | "sharp" | "beckmann" | "ashikhmin_shirley"
# glass_bsdf, refraction_bsdf [shader] color roughness ior normal   params: distribution
# metallic_bsdf [shader] base_color edge_tint roughness anisotropy rotation normal
#             params: distribution, fresnel "f82"|"physical_conductor"; ior extinction
# translucent_bsdf [shader] color normal        transparent_bsdf [shader] color       sheen_bsdf [shader] color roughness normal
# subsurface_scattering [shader] (shown as diffuse)     emission [shader] color strength     background [shader] color strength
# holdout [shader]       mix_shader [shader] fac shader shader_001        add_shader [shader] shader shader_001
# image_texture [color alpha] vector   params: image (handle or None: magenta), interpolation "linear"|"closest"|"cubic"|"smart",
#             extension "repeat"|"extend"|"clip"|"mirror", projection "flat"|"box"|"sphere"|"tube", projection_blend,
#             mapping: 3×4 row-major or None
# environment_texture [color] vector   params: image, interpolation, projection "equirectangular"|"mirror_ball"
# checker_texture [color fac] vector color1 color2 scale
# noise_texture [fac color] vector w scale detail roughness lacunarity offset gain distortion
#             params: dimensions "1D".."4D", noise_type, normalize
# voronoi_texture [distance color position w radius] vector w scale detail roughness lacunarity smoothness exponent randomness
#             params: dimensions, feature, distance (metric), normalize
# wave_texture [color fac] vector scale distortion detail detail_scale detail_roughness phase_offset  params: wave_type
#             bands_direction rings_direction profile        gradient_texture [color fac] vector  params: gradient_type
# magic_texture [color fac] vector scale distortion  params: depth
# white_noise_texture [value color] vector w  params: dimensions
# brick_texture [color fac] vector color1 color2 mortar scale mortar_size mortar_smooth bias brick_width row_height
#             params: offset offset_frequency squash squash_frequency
# sky_texture [color] vector  params: sky_type preetham (sun_direction turbidity), others: sun_elevation sun_rotation sun_size
#             sun_intensity sun_disc altitude air_density dust_density|aerosol_density ozone_density
# texture_coordinate [generated normal uv object camera window reflection]   params: object_to_world 4×4 inverse or None
# uv_map [uv] params: uv_map ("" = active)
# attribute [color vector fac alpha] params: name, kind "geometry"|"object"|"instancer"|"view_layer"
# color_attribute [color alpha] params: name
# mapping [vector] vector location rotation scale  params: kind point|texture|vector|normal
# rgb [color] params: value     value [value] params: value
# mix [result] factor a b   params: data_type "float"|"vector"|"color", blend (Blender's blend_type lower case),
#             clamp_factor, clamp_result, factor_mode
# math [value] value value_001 value_002  params: operation (Blender's, lower case), clamp
# vector_math [vector value] vector vector_001 vector_002 scale  params: operation
# separate [red green blue] color  params: mode rgb|hsv|hsl|xyz         combine [color] red green blue  params: mode
# color_ramp [color alpha] fac  params: table: float32 (n, 4) sampled evenly over [0, 1], interpolate: bool
# rgb_curve / vector_curve / float_curve [color|vector|value] fac color|vector|value  params: table (n, 3|1), range (lo, hi)
# hue_saturation [color] hue saturation value fac color     gamma [color] color gamma      invert [color] fac color
# bright_contrast [color] color bright contrast   rgb_to_bw [val] color    clamp [result] value min max   params: kind
# map_range [result vector] value from_min from_max to_min to_max steps vector…  params: data_type, interpolation, clamp
# normal_map [normal] strength color  params: space "tangent"|"object"|"world"|"blender_object"|"blender_world", uv_map, shadowing
#             "conty"|"chiang" (before Blender 4.3); a corner attribute "tangents of UV_MAP" (xyz, sign of the bitangent)
#             is taken where it is
# bump [normal] strength distance height normal  params: invert filter_width (pixels) shadowing
# normal [normal dot] normal  params: direction
# fresnel [fac] ior normal      layer_weight [fresnel facing] blend normal     camera [view_vector view_z_depth view_distance]
# geometry [position normal tangent true_normal incoming parametric backfacing pointiness random_per_island]
# light_path [is_camera_ray is_shadow_ray is_diffuse_ray is_glossy_ray is_singular_ray is_reflection_ray is_transmission_ray
#             ray_length ray_depth diffuse_depth glossy_depth transparent_depth transmission_depth]
# object_info [location color alpha object_index material_index random]     particle_info […]  vertex_color = color_attribute
# blackbody [color] temperature     wavelength [color] wavelength     vector_transform [vector] vector params: kind from to
# --------------------------------------------------------------------------------------------------------------------
Graph = Mapping[str, Any]

class Changes(TypedDict):
    version: int              # the scene's version after this commit
    effects: dict[str, bool]  # what the scene can show at all: textures, glossy, transmission, transparency, world, …
    meshes: int               # counts of what was rebuilt, moved, re-coloured, …
    instances: int
    materials: int
    lights: int
    everything: bool
    warnings: list[str]       # what was left out and why, each with the object's name; said once
    seconds: float            # spent in commit, BVH included

# bits of visibility: to which rays an instance, a light or the world shows itself
CAMERA: int
DIFFUSE: int
GLOSSY: int
TRANSMISSION: int
SHADOW: int
VOLUME: int
ALL_RAYS: int

class Scene:
    """Plain tables edited by handle. Edits take effect at `commit`; while a Session renders this scene, edit inside
    `with session.edit():`, which stops it within 50 ms and starts it again on what was committed."""
    def __init__(self) -> None: ...

    def add_image(self, source: str | bytes | NDArray[np.float32] | NDArray[np.uint8] | Mapping[int, Any], *, name: str,
                  colorspace: str = "sRGB", alpha: str = "straight") -> int:
        """A path, an encoded file's bytes, pixels (height, width, 1–4; row 0 at the bottom), or for UDIM {1001: any of
        these, …}. colorspace: "sRGB", "linear" (Rec. 709), "non-color", or a name OpenImageIO knows. alpha: "straight",
        "premultiplied", "channel_packed", "none". A file that cannot be read is magenta and gives a warning at commit."""
    def set_image(self, image: int, source: Any, **kwargs: Any) -> None: ...
    def remove_image(self, image: int) -> None: ...

    def add_material(self, graph: Graph, *, name: str, pass_index: int = 0, emission_sampling: bool = True,
                     backface_culling: bool = False) -> int: ...
    def set_material(self, material: int, graph: Graph, **kwargs: Any) -> None: ...
    def remove_material(self, material: int) -> None: ...

    def add_mesh(self, *, name: str, positions: NDArray[np.float32],
                 triangles: NDArray[np.int32] | NDArray[np.uint32] | None = None, corners: NDArray[Any] | None = None,
                 corner_vertices: NDArray[Any] | None = None, corner_normals: NDArray[np.float32] | None = None,
                 vertex_normals: NDArray[np.float32] | None = None, smooth: NDArray[np.bool_] | None = None,
                 faces: NDArray[Any] | None = None, materials: NDArray[Any] | None = None,
                 uvs: Mapping[str, NDArray[np.float32]] | None = None, active_uv: str = "",
                 attributes: Mapping[str, tuple[str, NDArray[Any]]] | None = None, active_color: str = "",
                 previous_positions: NDArray[np.float32] | None = None) -> int:
        """positions (V, 3); triangles (T, 3) vertex indices; corners (T, 3) indices into the per-corner arrays (None: 3t+k);
        corner_vertices (C,) the vertex of each corner, with corners in place of triangles; corner_normals (C, 3) or
        vertex_normals (V, 3), object space (None: flat where not smooth); faces (T,) face of each triangle (None: itself);
        smooth (F,) and materials (F,) slot of each face; uvs name → (C, 2);
        attributes name → ("vertex"|"corner"|"face"|"mesh", (N, 1–4) float32 or uint8 colours, sRGB-encoded bytes as
        scene-linear floats only). Non-finite vertices and index errors: the mesh renders without the triangles that hold
        them, and a warning names it."""
    def set_mesh(self, mesh: int, **kwargs: Any) -> None:
        """As add_mesh. Only positions (and normals) given, same counts: the mesh deformed, all else is kept."""
    def remove_mesh(self, mesh: int) -> None: ...

    def add_instances(self, mesh: int, transforms: NDArray[np.float64], *, name: str, materials: Sequence[int] = (),
                      object_index: int = 0, visibility: int = ..., holdout: bool = False, shadow_catcher: bool = False,
                      color: tuple[float, float, float, float] = (1, 1, 1, 1), randoms: NDArray[np.float32] | None = None,
                      previous: NDArray[np.float64] | None = None) -> NDArray[np.uint32]:
        """transforms (N, 4, 4), object to world, row-major as numpy and Blender have them. materials: one handle a slot
        (missing ones are the default grey). Returns N handles. Singular or non-finite transforms: left out, with a warning."""
    def set_transforms(self, instances: NDArray[np.uint32], transforms: NDArray[np.float64]) -> None: ...
    def set_instances(self, instances: NDArray[np.uint32], **kwargs: Any) -> None: ...
    def remove_instances(self, instances: NDArray[np.uint32]) -> None: ...

    def add_light(self, kind: str, transform: NDArray[np.float64], *, name: str, color: tuple[float, float, float],
                  power: float, radius: float = 0.0, angle: float = 0.0, spot_size: float = 0.0, spot_blend: float = 0.0,
                  shape: str = "square", size: tuple[float, float] = (1, 1), spread: float = 3.14159265,
                  graph: Graph | None = None,
                  visibility: int = ..., cast_shadow: bool = True, multiple_importance: bool = True, soft_falloff: bool = True,
                  version: int = 2) -> int:
        """kind "point" (power in W, radius), "spot" (power in W, radius, spot_size full cone angle, spot_blend 0–1),
        "sun" (power in W/m², angle full disk angle), "area" (power in W, shape "square"|"rectangle"|"disk"|"ellipse",
        spread full angle). Units as Blender's users know them. Lights look along their local −z. graph: an emission
        graph that multiplies color (None: 1). version 1 is what Blender before 4.0 meant: a spot falls off by the cosine to
        its axis and knows no scale, a sun's disk grows brighter to its rim by the cube of the cosine."""
    def set_light(self, light: int, **kwargs: Any) -> None: ...
    def remove_light(self, light: int) -> None: ...

    def set_world(self, graph: Graph | None, *, visibility: int = ..., importance_resolution: int = 0) -> None: ...
    def set_camera(self, kind: str, transform: NDArray[np.float64], *, window: tuple[float, float, float, float],
                   clip: tuple[float, float] = (0.0, float("inf")), aperture_radius: float = 0.0, focus_distance: float = 1.0,
                   aperture_blades: int = 0, aperture_rotation: float = 0.0, aperture_ratio: float = 1.0,
                   panorama: tuple[float, float, float, float] = ...) -> None:
        """kind "perspective": window (left, right, bottom, top) at distance 1 in camera space; "orthographic": the same in
        scene units; "panorama" (equirectangular): panorama (longitude min, max, latitude min, max). The camera looks along
        its local −z, y up. The window is stretched over the full image; border and shift are the caller's arithmetic
        (RenderSettings.region renders a part)."""
    def commit(self, flatten: bool | str | None = None) -> Changes:
        """flatten: meshes that one instance alone uses stand in one common BVH from now on: rays half as fast again. True,
        for final renders: built anew when anything in it changed. "still", for viewports: what changes leaves it and gets a
        BVH of its own, at once. None: as before, False at first."""
    def changes_since(self, version: int) -> dict[str, Any]:
        """Handles of what changed in the commits after `version`, by kind (meshes_added, instances_moved, …), and the flags
        everything (the log is too short to tell), camera, world, origin."""
    @property
    def version(self) -> int: ...
    @property
    def bounds(self) -> tuple[tuple[float, float, float], tuple[float, float, float]]: ...
    @property
    def bytes(self) -> dict[str, int]: ...      # memory by table, BVH included
    def intersect(self, origins: NDArray[np.float64], directions: NDArray[np.float64]) -> dict[str, NDArray[Any]]:
        """Closest hits of N rays: distance (inf: none), instance, triangle, barycentric (N, 2), normal (N, 3)."""
    def occluded(self, origins: NDArray[np.float64], targets: NDArray[np.float64], together: int = 1) -> NDArray[np.bool_]:
        """Whether anything is between N pairs of places; `together` (1 to 16) rays are asked at once."""
    @property
    def origin(self) -> tuple[float, float, float]: ...  # what kernels' 32-bit coordinates are relative to
    def surface(self, origins: NDArray[np.float64], directions: NDArray[np.float64]) -> dict[str, NDArray[Any]]:
        """What renderers know about closest hits: valid, position, face_normal, normal, uv, material, backfacing, and where
        the next ray would start `above` and `below` the face."""
    def camera_rays(self, pixels: NDArray[np.float32], lens: NDArray[np.float32], width: int, height: int
                    ) -> dict[str, NDArray[np.float32]]:
        """Rays of the camera through (N, 2) places in pixels with (N, 2) lens samples, relative to `origin`: origin,
        direction, their differentials a pixel (origin_dx, …), range (nearest and furthest distance)."""

class Session:
    """One background render that can be asked, changed, paused and cancelled from any thread."""
    def __init__(self, scene: Scene, settings: Mapping[str, Any]) -> None:
        """settings, all optional:
        width, height: full image; region (x0, y0, x1, y1) in pixels, x1/y1 exclusive, row 0 at the bottom
        method "AUTO" (INSTANT_CACHE in viewports, else PATH_TRACING)|"PATH_TRACING"|…; samples;
        accuracy (0: exactly `samples`); time_limit; seed; frame; threads (0: all)
        max_bounces diffuse_bounces glossy_bounces transmission_bounces transparent_max_bounces
        sample_clamp_direct sample_clamp_indirect (0: off) caustics_reflective caustics_refractive
        pixel_filter "BLACKMAN_HARRIS"|"GAUSSIAN"|"BOX", filter_width; film_transparent; film_exposure
        passes: names of the passes to keep (below); denoise: bool; denoiser "AUTO" (OpenImageDenoise where there is one)|
        "OPENIMAGEDENOISE"|"LAYERED"
        viewport: bool (start coarse: passes at 1/8, 1/4, 1/2 of the resolution first)
        sight: bool (methods of a cache: rays that end at the first surface tell how much of a pixel at the edge of a window, a
            lamp or the sky shines; on by default)
        carry_over: bool (methods whose answers have no noise: where an edit, or in final renders what changed since the last
            one, leaves a pixel as it is, its samples stay; `samples` is what every pixel has then; direct light is smoothed)
        mist (start, depth, "quadratic"|"linear"|"inverse_quadratic")
        local_view: instance handles that this view shows, or None."""
    def start(self) -> None: ...
    def wait(self, timeout: float = ...) -> bool: ...   # True: finished (or failed: raises)
    def cancel(self) -> None: ...                       # returns when stopped (≤ 50 ms)
    def pause(self) -> None: ...
    def resume(self) -> None: ...
    def edit(self) -> Any: ...                          # context manager: stopped inside, restarted on leaving
    def update(self, settings: Mapping[str, Any]) -> None: ...   # changed settings; restarts when they change the image
    def save_cache(self, path: str) -> None:
        """What the method remembers of the scene, into a file; InvalidInput while it renders or where there is nothing."""
    def load_cache(self, path: str) -> None:
        """The same from a file, for the next start(); InvalidInput where the file is of another scene."""
    def forget_cache(self) -> None:
        """Drops what the method remembers of the scene, so that the next start() begins from nothing."""
    def progress(self) -> dict[str, Any]:
        """state "idle"|"running"|"paused"|"finished"|"cancelled"|"failed", fraction, samples, remaining (s, None unknown),
        elapsed, stage, error (believed relative error; None: not known, or the method has a bias, which no spread shows),
        noise (what the samples spread by), generation (grows with every new readable result)"""
    def passes(self) -> list[str]: ...
    def read(self, name: str = "combined", out: NDArray[np.float32] | None = None) -> NDArray[np.float32]:
        """(height, width, channels) of the region, row 0 at the bottom; readable at any time, never stops the render.
        Names: combined (RGBA, premultiplied), depth mist position normal uv object_index material_index
        diffuse_direct diffuse_indirect diffuse_color glossy_direct glossy_indirect glossy_color transmission_direct
        transmission_indirect transmission_color emission environment albedo denoise_normal denoise_surface (12, of the first
        surface that is neither mirror nor glass: position from the scene's origin, footprint, length of the ray to it, share of
        samples that met one, albedo; light of emitters and sky behind mirrors and glass: all sums over the samples by
        their number)
        sample_count
        error (standard error of the mean, luminance), batches (16 batch means of luminance)"""
    def statistics(self) -> dict[str, Any]:
        """method, samples, seconds by stage (sync aside), rays by kind, believed_error, error_low/high (None for a method with a
        bias: it has `noise` alone, what its samples spread by), noise, bytes, dropped
        (non-finite values), warnings, passes_log, threads, effects, denoiser"""

def method_descriptions() -> list[dict[str, Any]]:
    """Every method about itself: id, label, description, settings [{name, label, description, type, default, min, max, unit}],
    debug_views, statistics."""
def chosen_method(method: str, viewport: bool) -> str:
    """The id of the method that renders: AUTO stands for another one in viewports than in renders."""
def denoisers(search: Sequence[str] = ()) -> list[dict[str, Any]]:
    """[{id, label, available: bool, reason, path, version}]"""
def denoise(color: NDArray[np.float32], albedo: NDArray[np.float32] | None = None, normal: NDArray[np.float32] | None = None,
            *, denoiser: str = "AUTO", search: Sequence[str] = (), prefilter: bool = False,
            surface: NDArray[np.float32] | None = None, error: NDArray[np.float32] | None = None,
            seen: NDArray[np.float32] | None = None) -> NDArray[np.float32]:
    """RGB of images (height, width, 3 or 4); values that are not finite count as their neighbours' mean. prefilter: albedo
    and normal are filtered first, which pays where they are noisy. LAYERED needs normal (pass denoise_normal), surface (pass
    denoise_surface) and error (relative, of each pixel), and leaves `seen` as it is: light of emitters and sky, met by the
    camera's rays themselves or through mirrors and glass. Unsupported where the denoiser is not found."""
def versions() -> dict[str, str]: ...   # embree, tbb, openimageio, pybind11, compiler
def set_log(sink: Callable[[str, str], None] | None) -> None: ...

# For tests and researchers: the building blocks by themselves.
def bsdf_evaluate(graph: Graph, wo: NDArray[np.float32], wi: NDArray[np.float32],
                  **point: Any) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """value × |cos| (N, 3) and density (N,) for directions in the local frame (z = normal)."""
def bsdf_sample(graph: Graph, wo: NDArray[np.float32], u: NDArray[np.float32], **point: Any) -> dict[str, NDArray[Any]]: ...
def evaluate_graph(graph: Graph, points: Mapping[str, NDArray[Any]], **point: Any) -> dict[str, Any]:
    """A material's graph at N points (position, normal, face_normal, incoming (N, 3), uv (N, 2); one row: for all). Returns
    emission, transparency, diffuse, glossy, transmission (albedos), normal of the first lobe (N, 3), lobes (N,), warnings,
    folded, instructions. Keywords as in bsdf_evaluate: backfacing, drop_glossy, drop_refractive, kind (of the ray), fold."""
def light_sample(scene: Scene, point: NDArray[np.float64], normal: NDArray[np.float32],
                 u: NDArray[np.float32]) -> dict[str, NDArray[Any]]:
    """Choices of a light and a direction from N points (arrays of one row stand for all): u (N, 3) are the choice and two
    numbers for the direction; normal 0: from all sides. valid, direction (N, 3), distance, radiance (N, 3), density
    (solid angle, choice included), delta, light."""
def light_density(scene: Scene, point: NDArray[np.float64], normal: NDArray[np.float32],
                  direction: NDArray[np.float32]) -> dict[str, NDArray[Any]]:
    """What rays meet, as a surface's own samples would: distance, radiance (N, 3), and the density with which light_sample
    chooses the same direction on what was met (nearest light or surface; else suns and world together)."""
def record_rays(scene: Scene, settings: Mapping[str, Any] = ..., most: int = 500_000) -> dict[str, NDArray[np.float64]]:
    """The rays that a render with these settings traces, spread over the image, for measure_rays: closest_origins,
    closest_directions, occluded_origins, occluded_targets, each (N, 3), world space."""
def measure_rays(scene: Scene, origins: NDArray[np.float64], directions: NDArray[np.float64], kind: str = "closest",
                 rounds: int = 8) -> dict[str, Any]:
    """Seconds of all rays on one thread, through native/rays (wrapped) and by bare Embree calls (bare), in alternating
    pairs. kind "closest", or "occluded": then directions are targets."""
def occupied_cells(scene: Scene, levels: int, points: NDArray[np.float64] = ..., threads: int = 0,
                   normals: NDArray[np.float64] = ..., light: NDArray[np.float64] = ...) -> dict[str, Any]:
    """Cells that hold geometry, on grids of 1 to 2^levels (at most 14) cells each way: cells, blocks, maps, map_bytes and
    data_bytes a level, seconds_mark, seconds_maps, peak_bytes; index (levels + 1, N): each point's cell's data on each level,
    -1 where empty. Where each point brings light to the side that its normal faces, light (levels + 1, N, 3) is what its
    cells hold then."""
def both_sides(normals: NDArray[np.float64], sums: NDArray[np.float64], samples: NDArray[np.int64], frames: NDArray[np.int64],
               changed: int = 0) -> dict[str, Any]:
    """A cell of that structure after so many updates, each a sum of samples that come to the side of a normal in a frame, the
    scene having changed in frame `changed`: front, back, counts of both, normal, frame, bytes."""
def caching_share(view_moved: bool, step: int) -> float:
    """Share of its paths that a viewport's pass, on a grid of so many pixels, sends into a cache that is filled as it renders."""
def denoise_plan(viewport: bool, samples: int, kept: int, exact: bool) -> tuple[bool, bool]:
    """Whether a picture's albedo and normal are filtered by themselves first, and whether the small network does: by the samples
    of each pixel on average, and those of the typical one in a film that keeps them from frame to frame (else 0). exact: no cache
    answers."""
def cuckoo_map(keys: NDArray[np.uint32], usage: float, asked: NDArray[np.uint32]) -> dict[str, Any]:
    """The paper's map over keys that differ, with `usage` slots for each at first: found, the place of each asked key among the
    keys (-1: none); attempts, how often it was built; bytes."""
def measure_lookups(cells: int, lookups: int) -> dict[str, float]:
    """Look-ups a second on one thread among so many cells of the HashCache, each of which reads the cell's light: in the table
    of cells that are made when needed, in the paper's map over occupied cells (data included), and bare random reads of the
    table's memory. table, map, reads; table_bytes, map_bytes."""
def cell_keys(cells: NDArray[np.int64]) -> NDArray[np.uint64]:
    """The 64 bits by which the HashCache knows cells, rows of x, y, z, owner, level. Never with a lower half of 0."""
def samples_worth(samples: int, doubt: float) -> int:
    """How many of its samples a cell's light of before an edit counts for, where edits since have left so much doubt."""
def updated_cell(light: float, count: int, sums: NDArray[np.float64], samples: int = 1) -> dict[str, Any]:
    """A cell of the HashCache that holds `count` samples of grey light (0: none), after one update a row of sums (N, 3), each
    of so many samples: light, count."""
def sobol(count: int, dimensions: int, seed: int) -> NDArray[np.float32]: ...
