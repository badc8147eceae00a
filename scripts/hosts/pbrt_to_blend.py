# SPDX-License-Identifier: MIT
"""Blender, headless: a small scene of scenes/ as a .blend for Cycles, to compare renderers on.

    blender -b --factory-startup --python scripts/hosts/pbrt_to_blend.py -- scenes/glossy.pbrt OUT.blend [WIDTHxHEIGHT [OUT.pbrt]]

Knows triangle meshes, PLY files, quadrics and objects; diffuse, conductor and dielectric materials; checkerboards and pictures on uv;
area lights (which emit from the side of their normal), suns and constant surroundings. Anything else is named and ends it. Three
things are made simpler: a diffuse surface loses its coat, a metal is told by its colour, and portals are left out. OUT.pbrt is the
scene with these, so that both renderers have the same.
"""
import math
import re
import sys
from pathlib import Path

import bpy
import numpy as np
from mathutils import Matrix, Vector

METALS = {"Ag": (.96, .95, .92), "Al": (.91, .92, .92), "Au": (.99, .78, .34), "Cu": (.95, .64, .54)}  # colours at normal incidence
REFUSED = {"alpha", "displacement", "normalmap", "lensradius"}
MIRROR = Matrix.Scale(-1, 4, (1, 0, 0))  # pbrt's coordinates are left-handed
TOKEN = re.compile(r'"[^"]*"|\[[^\]]*\]|[^\s\[\]"]+')
PARAMETER = re.compile(r'"(integer|float|string|rgb|spectrum|texture|point2|point3|normal|bool) ')


def tokens(path):
    text = re.sub(r"#.*", "", path.read_text())
    items = iter(TOKEN.findall(text))
    for t in items:
        if t == "Include":
            yield from tokens(path.parent / next(items).strip('"'))
        else:
            yield t


def directives(path):
    """(name, positional arguments, parameters by name) in order."""
    name, arguments = None, []
    for t in tokens(path):
        if re.fullmatch(r"[A-Z][A-Za-z]+", t):
            if name:
                yield name, *split(arguments)
            name, arguments = t, []
        else:
            arguments.append(t)
    yield name, *split(arguments)


def split(arguments):
    position, parameters, at = [], {}, 0
    while at < len(arguments):
        text = arguments[at].strip('"')
        if PARAMETER.match(arguments[at]):
            value = arguments[at + 1].strip("[] ")
            kind, name = text.split()
            parameters[name] = Values(kind, [v.strip('"') for v in TOKEN.findall(value)] if '"' in value else
                                      [v == "true" if kind == "bool" else float(v) for v in value.split()])
            at += 2
        else:
            position.append(text)
            at += 1
    return position, parameters


class Values(list):
    """Of a parameter: texts, numbers or truths; `kind` is its type."""

    def __init__(self, kind, values):
        super().__init__(values)
        self.kind = kind


def simpler(name, position, p):
    """A directive without what Cycles has no equal of."""
    if name in ("Material", "MakeNamedMaterial"):
        kind = position[0] if name == "Material" else p["type"][0]
        if kind == "coateddiffuse":
            kind, p = "diffuse", {k: v for k, v in p.items() if k in ("type", "reflectance")}
        if kind == "conductor":
            metal = p.get("eta", ["metal-Cu-eta"])[0].split("-")[1]
            colour = p.get("reflectance") or Values("rgb", METALS[metal])
            p = {**{k: v for k, v in p.items() if k not in ("eta", "k")}, "reflectance": colour}
        if name == "Material":
            position = [kind]
        else:
            p = {**p, "type": Values("string", [kind])}
    return position, {k: v for k, v in p.items() if k != "portal"}


def written(folder, name, position, parameters):
    """A directive as text; files by their whole path."""
    def value(key, v):
        held = [str((folder / v[0]).resolve())] if key == "filename" and name in ("Texture", "Shape") else v
        texts = (f'"{x}"' if isinstance(x, str) else str(x).lower() if isinstance(x, bool) else repr(x).removesuffix(".0") for x in held)
        return f' "{v.kind} {key}" [ {" ".join(texts)} ]'
    bare = name in ("Translate", "Rotate", "Scale", "LookAt")
    words = (x if bare else f'"{x}"' for x in position)
    return " ".join([name, *words]) + "".join(value(k, v) for k, v in parameters.items()) + "\n"


class Exporter:
    def __init__(self, size):
        bpy.ops.wm.read_factory_settings(use_empty=True)
        self.scene = bpy.context.scene
        self.scene.render.engine = "CYCLES"
        self.size = size
        self.matrix, self.material, self.emission = Matrix(), self.build("diffuse", {}), None
        self.stack, self.named, self.textures = [], {}, {}
        self.objects, self.recorded = {}, None
        view = self.scene.view_settings
        view.view_transform, view.look = "Standard", "None"

    def run(self, path):
        """The scene's text, simpler where this exporter made it so."""
        self.path, text = path, []
        for name, position, parameters in directives(path):
            action = getattr(self, name, None)
            if action is None:
                sys.exit(f"pbrt_to_blend: {path}: {name} is not known here")
            position, parameters = simpler(name, position, parameters)
            if refused := REFUSED & parameters.keys():
                sys.exit(f"pbrt_to_blend: {path}: {name} \"{refused.pop()}\" is not known here")
            action(position, parameters)
            text.append(written(path.parent, name, position, parameters))
        return "".join(text)

    def ignore(self, *_):
        pass
    WorldBegin = Sampler = PixelFilter = ignore

    def Integrator(self, _, p):
        bounces = int(p["maxdepth"][0]) - 1  # Cycles does not count the one to the light
        for kind in ("max", "diffuse", "glossy", "transmission"):
            setattr(self.scene.cycles, kind + "_bounces", bounces)

    # --- state ---------------------------------------------------------------------------------------------------------

    def AttributeBegin(self, *_):
        self.stack.append((self.matrix.copy(), self.material, self.emission))

    def AttributeEnd(self, *_):
        self.matrix, self.material, self.emission = self.stack.pop()

    def Translate(self, position, _):
        self.matrix = self.matrix @ Matrix.Translation([float(v) for v in position])

    def Rotate(self, position, _):
        angle, *axis = (float(v) for v in position)
        self.matrix = self.matrix @ Matrix.Rotation(math.radians(angle), 4, Vector(axis))

    def Scale(self, position, _):
        self.matrix = self.matrix @ Matrix.Diagonal([*(float(v) for v in position), 1])

    def ObjectBegin(self, position, _):
        self.AttributeBegin()
        self.matrix = Matrix()
        self.recorded = self.objects[position[0]] = []

    def ObjectEnd(self, *_):
        self.recorded = None
        self.AttributeEnd()

    def ObjectInstance(self, position, _):
        for mesh, matrix in self.objects[position[0]]:
            self.place(mesh, self.matrix @ matrix)

    # --- camera --------------------------------------------------------------------------------------------------------

    def Film(self, _, parameters):
        render = self.scene.render
        width, height = self.size or (int(parameters["xresolution"][0]), int(parameters["yresolution"][0]))
        render.resolution_x, render.resolution_y, render.resolution_percentage = width, height, 100

    def LookAt(self, position, _):
        eye, at, up = (MIRROR @ Vector([float(v) for v in position[k:k + 3]]) for k in (0, 3, 6))
        forward = (at - eye).normalized()
        right = forward.cross(up).normalized()
        above = right.cross(forward)
        self.view = Matrix((right, above, -forward)).transposed().to_4x4()
        self.view.translation = eye

    def Camera(self, _, parameters):
        camera = bpy.data.cameras.new("camera")
        wide = self.scene.render.resolution_x > self.scene.render.resolution_y
        camera.sensor_fit = "VERTICAL" if wide else "HORIZONTAL"  # pbrt's angle is that of the shorter side
        camera.clip_start, camera.clip_end = 1e-3, 1e5
        angle = math.radians(parameters.get("fov", [90])[0])
        setattr(camera, "angle_y" if wide else "angle_x", angle)
        eye = bpy.data.objects.new("camera", camera)
        eye.matrix_world = self.view
        self.scene.collection.objects.link(eye)
        self.scene.camera = eye

    # --- appearance ----------------------------------------------------------------------------------------------------

    def build(self, kind, p):
        """A material that can be made into Blender's: node of its BSDF, by nodes and links."""
        rough = max(p.get(name, [0.0])[0] for name in ("roughness", "uroughness", "vroughness"))
        if p.get("remaproughness", [True])[0]:
            rough = math.sqrt(rough)  # pbrt's alpha; Blender's roughness is its root
        colour = p.get("reflectance", [.5, .5, .5])

        def diffuse(nodes, links):
            shader = nodes.new("ShaderNodeBsdfDiffuse")
            if isinstance(colour[0], str):
                links.new(self.textures[colour[0]](nodes, links), shader.inputs["Color"])
            else:
                shader.inputs["Color"].default_value = (*colour, 1)
            return shader

        def conductor(nodes, links):
            shader = nodes.new("ShaderNodeBsdfAnisotropic" if bpy.app.version >= (4, 0) else "ShaderNodeBsdfGlossy")
            shader.distribution = "GGX"
            shader.inputs["Roughness"].default_value = math.sqrt(rough)
            links.new(metal_colour(nodes, links, colour), shader.inputs["Color"])
            return shader

        def dielectric(nodes, _):
            shader = nodes.new("ShaderNodeBsdfGlass")
            shader.distribution = "GGX"
            shader.inputs["Color"].default_value = (1, 1, 1, 1)
            shader.inputs["IOR"].default_value = p.get("eta", [1.5])[0]
            shader.inputs["Roughness"].default_value = math.sqrt(rough)
            return shader
        known = {"diffuse": diffuse, "conductor": conductor, "dielectric": dielectric}
        if kind not in known:
            sys.exit(f"pbrt_to_blend: material {kind} is not known here")
        return known[kind]

    def blender_material(self):
        """Of the current material and emission."""
        m = bpy.data.materials.new("material")
        m.use_nodes = True
        nodes, links = m.node_tree.nodes, m.node_tree.links
        nodes.clear()
        shader = self.material(nodes, links)
        if self.emission:
            colour, both_sides = self.emission
            lamp, both = nodes.new("ShaderNodeEmission"), nodes.new("ShaderNodeAddShader")
            lamp.inputs["Color"].default_value = (*colour, 1)
            if not both_sides:
                front = nodes.new("ShaderNodeMath")
                front.operation, front.inputs[0].default_value = "SUBTRACT", 1
                links.new(nodes.new("ShaderNodeNewGeometry").outputs["Backfacing"], front.inputs[1])
                links.new(front.outputs[0], lamp.inputs["Strength"])
                if hasattr(m.cycles, "emission_sampling"):
                    m.cycles.emission_sampling = "FRONT"
            links.new(shader.outputs[0], both.inputs[0])
            links.new(lamp.outputs[0], both.inputs[1])
            shader = both
        links.new(shader.outputs[0], nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
        return m

    def Material(self, position, parameters):
        self.material = self.build(position[0], parameters)

    def MakeNamedMaterial(self, position, parameters):
        self.named[position[0]] = self.build(parameters.get("type", ["diffuse"])[0], parameters)

    def NamedMaterial(self, position, _):
        self.material = self.named[position[0]]

    def Texture(self, position, p):
        name, _, kind = position
        if kind not in ("checkerboard", "imagemap"):
            sys.exit(f"pbrt_to_blend: texture {kind} is not known here")
        file = str((self.path.parent / p["filename"][0]).resolve()) if kind == "imagemap" else None

        def node(nodes, links):
            picture = nodes.new("ShaderNodeTexImage" if file else "ShaderNodeTexChecker")
            place, scale = nodes.new("ShaderNodeTexCoord"), nodes.new("ShaderNodeMapping")
            scale.inputs["Scale"].default_value = (p.get("uscale", [1.0])[0], p.get("vscale", [1.0])[0], 0)
            scale.inputs["Location"].default_value = (0, 0, 1.5)  # Blender's checkerboard has three dimensions
            links.new(place.outputs["UV"], scale.inputs["Vector"])
            links.new(scale.outputs["Vector"], picture.inputs["Vector"])
            if file:
                picture.image = bpy.data.images.load(file, check_existing=True)
            else:
                picture.inputs["Scale"].default_value = 1
                for ours, theirs in (("tex1", "Color1"), ("tex2", "Color2")):
                    picture.inputs[theirs].default_value = (*p[ours], 1)
            return picture.outputs["Color"]
        self.textures[name] = node

    # --- lights --------------------------------------------------------------------------------------------------------

    def AreaLightSource(self, _, p):
        self.emission = p["L"], p.get("twosided", [False])[0]

    def LightSource(self, position, p):
        scale = p.get("scale", [1.0])[0]
        if position[0] == "infinite" and "L" in p:
            world = self.scene.world = bpy.data.worlds.new("surroundings")
            world.use_nodes = True
            world.node_tree.nodes["Background"].inputs["Color"].default_value = (*(scale * c for c in p["L"]), 1)
        elif position[0] == "distant":
            sun = bpy.data.lights.new("sun", "SUN")
            strongest = max(p["L"])
            sun.color, sun.energy, sun.angle = [c / strongest for c in p["L"]], scale * strongest, 0
            to_light = Vector(p.get("from", [0, 0, 0])) - Vector(p.get("to", [0, 0, 1]))
            lamp = bpy.data.objects.new("sun", sun)
            to_light = (MIRROR @ self.matrix).to_3x3() @ to_light
            lamp.rotation_euler = to_light.to_track_quat("Z", "Y").to_euler()  # it shines along -Z
            self.scene.collection.objects.link(lamp)
        else:
            sys.exit(f"pbrt_to_blend: light {position[0]} is not known here")

    # --- shapes --------------------------------------------------------------------------------------------------------

    def Shape(self, position, p):
        kind = position[0]
        if kind == "trianglemesh":
            points, uv = np.reshape(p["P"], (-1, 3)), np.reshape(p["uv"], (-1, 2)) if "uv" in p else None
            faces, smooth = np.reshape(p["indices"], (-1, 3)).astype(int), False
        elif kind == "plymesh":
            points, uv, faces, smooth = ply(self.path.parent / p["filename"][0])
        elif kind in ("sphere", "cylinder", "disk"):
            (points, faces), uv, smooth = around(kind, p), None, kind != "disk"
        else:
            sys.exit(f"pbrt_to_blend: shape {kind} is not known here")
        mesh = bpy.data.meshes.new(kind)
        mesh.from_pydata([tuple(map(float, q)) for q in points], [], [[int(i) for i in f] for f in faces])
        mesh.validate()  # drops faces without area, which Blender cannot stand
        mesh.polygons.foreach_set("use_smooth", [smooth] * len(mesh.polygons))
        if uv is not None:
            layer = mesh.uv_layers.new()
            for loop, at in zip(mesh.loops, layer.data):
                at.uv = uv[loop.vertex_index]
        mesh.materials.append(self.blender_material())
        if self.recorded is not None:
            self.recorded.append((mesh, self.matrix.copy()))
        else:
            self.place(mesh, self.matrix)

    def place(self, mesh, matrix):
        shape = bpy.data.objects.new(mesh.name, mesh)
        shape.matrix_world = MIRROR @ matrix
        self.scene.collection.objects.link(shape)


def metal_colour(nodes, links, colour, stops=24):
    """What a conductor of a colour reflects, by the angle to its normal: Fresnel's equations with eta 1 and k = 2 sqrt(r / (1 - r)),
    as pbrt-v4 makes of a reflectance; the output of a ramp over the cosine."""
    facing = nodes.new("ShaderNodeVectorMath")
    facing.operation = "DOT_PRODUCT"
    geometry, ramp = nodes.new("ShaderNodeNewGeometry"), nodes.new("ShaderNodeValToRGB")
    links.new(geometry.outputs["Normal"], facing.inputs[0])
    links.new(geometry.outputs["Incoming"], facing.inputs[1])
    links.new(facing.outputs["Value"], ramp.inputs["Fac"])
    elements = ramp.color_ramp.elements
    for k in range(stops):
        cosine = (k / (stops - 1)) ** 2
        element = elements[min(k, 1) * (len(elements) - 1)] if k in (0, stops - 1) else elements.new(cosine)
        element.position, element.color = cosine, (*(conductor_fresnel(cosine, min(r, .9999)) for r in colour), 1)
    return ramp.outputs["Color"]


def conductor_fresnel(cosine, r):
    k2 = 4 * r / (1 - r)
    cos2, sin2 = cosine ** 2, 1 - cosine ** 2
    t0 = 1 - k2 - sin2
    a2b2 = math.sqrt(t0 * t0 + 4 * k2)
    t1, t2 = a2b2 + cos2, 2 * cosine * math.sqrt(max(0, (a2b2 + t0) / 2))
    t3, t4 = cos2 * a2b2 + sin2 * sin2, t2 * sin2
    rs = (t1 - t2) / (t1 + t2)
    return rs * (1 + (t3 - t4) / (t3 + t4)) / 2


def ply(path):
    """Points, texture coordinates (or None), faces, whether it has normals, of a binary PLY file as scenes/meshes has them."""
    data = path.read_bytes()
    head, body = data.split(b"end_header\n", 1)
    element, kinds, counts, lists = None, [], {}, None
    for line in head.decode().splitlines():
        words = line.split()
        if words[0] == "element":
            element, counts[words[1]] = words[1], int(words[2])
        elif words[0] == "property" and element == "vertex":
            kinds.append((words[2], "<f4"))
        elif words[0] == "property":
            lists = [{"uchar": "<u1", "ushort": "<u2", "int": "<i4", "uint": "<u4"}[w] for w in words[2:4]]
    vertices = np.frombuffer(body, np.dtype(kinds), counts["vertex"])
    faces, at, (length, corner) = [], vertices.nbytes, map(np.dtype, lists)
    for _ in range(counts["face"]):
        n = int(np.frombuffer(body, length, 1, at)[0])
        faces.append(np.frombuffer(body, corner, n, at + length.itemsize))
        at += length.itemsize + n * corner.itemsize
    names = vertices.dtype.names
    uv = next((np.stack([vertices[a], vertices[b]], -1) for a, b in (("u", "v"), ("s", "t")) if a in names), None)
    return np.stack([vertices[c] for c in "xyz"], -1), uv, faces, "nx" in names


def around(kind, p, steps=64):
    """Vertices and faces of a surface of revolution about z; normals as pbrt's, of a disk along z."""
    r = p.get("radius", [1.0])[0]
    low, high = p.get("zmin", [-1.0])[0], p.get("zmax", [1.0])[0]
    ring = {"sphere": [(r * math.sin(a), -r * math.cos(a)) for a in (math.pi * k / 32 for k in range(33))],
            "cylinder": [(r, low), (r, high)],
            "disk": [(r, p.get("height", [0.0])[0]), (0, p.get("height", [0.0])[0])]}[kind]
    points = [(q * math.cos(b), q * math.sin(b), z) for q, z in ring for b in (2 * math.pi * k / steps for k in range(steps))]
    faces = [(i * steps + k, i * steps + (k + 1) % steps, (i + 1) * steps + (k + 1) % steps, (i + 1) * steps + k)
             for i in range(len(ring) - 1) for k in range(steps)]
    return points, faces


arguments = sys.argv[sys.argv.index("--") + 1:]
exporter = Exporter(tuple(int(v) for v in arguments[2].split("x")) if len(arguments) > 2 else None)
text = exporter.run(Path(arguments[0]).resolve())
bpy.ops.wm.save_as_mainfile(filepath=str(Path(arguments[1]).resolve()))
if len(arguments) > 3:
    Path(arguments[3]).write_text(text)
