# SPDX-License-Identifier: MIT
"""Blender, headless: a small scene of scenes/ as a .blend for Cycles, to compare renderers' hosts on.

    blender -b --factory-startup --python scripts/hosts/pbrt_to_blend.py -- scenes/glossy.pbrt OUT.blend [WIDTHxHEIGHT]

Knows what the simple scenes use: triangle meshes, spheres, cylinders; diffuse, conductor and dielectric materials; checkerboards;
area lights (which emit from both sides here) and constant surroundings. Anything else is named and ends it.
"""
import math
import re
import sys
from pathlib import Path

import bpy
from mathutils import Matrix, Vector

METALS = {"metal-Cu-eta": (.95, .64, .54), "metal-Au-eta": (1., .78, .34), "metal-Al-eta": (.91, .92, .92)}  # colours at normal
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
            parameters[text.split()[1]] = ([v.strip('"') for v in TOKEN.findall(value)] if '"' in value else
                                           [float(v) for v in value.split()])
            at += 2
        else:
            position.append(text)
            at += 1
    return position, parameters


class Exporter:
    def __init__(self, size):
        bpy.ops.wm.read_factory_settings(use_empty=True)
        self.scene = bpy.context.scene
        self.scene.render.engine = "CYCLES"
        self.size = size
        self.matrix, self.material, self.emission = Matrix(), self.principled("white", (.5, .5, .5)), None
        self.stack, self.named, self.textures = [], {}, {}

    def run(self, path):
        for name, position, parameters in directives(path):
            action = getattr(self, name, None)
            if action is None:
                sys.exit(f"pbrt_to_blend: {path}: {name} is not known here")
            action(position, parameters)

    def ignore(self, *_):
        pass
    WorldBegin = Sampler = Integrator = PixelFilter = ignore

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

    def principled(self, kind, colour, texture=None, roughness=0.0):
        m = bpy.data.materials.new(kind)
        m.use_nodes = True
        nodes, links = m.node_tree.nodes, m.node_tree.links
        nodes.clear()
        shader = nodes.new({"conductor": "ShaderNodeBsdfGlossy", "dielectric": "ShaderNodeBsdfGlass",
                            "emission": "ShaderNodeEmission"}.get(kind, "ShaderNodeBsdfDiffuse"))
        shader.inputs["Color"].default_value = (*colour, 1)
        if kind in ("conductor", "dielectric"):
            shader.inputs["Roughness"].default_value = roughness
        if texture:
            links.new(texture(nodes, links), shader.inputs["Color"])
        links.new(shader.outputs[0], nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
        return m

    def build(self, kind, p):
        rough = p.get("roughness", p.get("vroughness", [0.0]))[0]
        if kind == "diffuse":
            value = p.get("reflectance", [.5, .5, .5])
            if isinstance(value[0], str):
                return self.principled(kind, (1, 1, 1), self.textures[value[0]])
            return self.principled(kind, value)
        if kind == "conductor":
            return self.principled(kind, METALS.get(p.get("eta", [""])[0], (.9, .9, .9)), roughness=math.sqrt(rough))
        if kind == "dielectric":
            return self.principled(kind, (1, 1, 1), roughness=rough)
        sys.exit(f"pbrt_to_blend: material {kind} is not known here")

    def Material(self, position, parameters):
        self.material = self.build(position[0], parameters)

    def MakeNamedMaterial(self, position, parameters):
        self.named[position[0]] = self.build(parameters.get("type", ["diffuse"])[0], parameters)

    def NamedMaterial(self, position, _):
        self.material = self.named[position[0]]

    def Texture(self, position, p):
        if position[2] != "checkerboard":
            sys.exit(f"pbrt_to_blend: texture {position[2]} is not known here")

        def node(nodes, links):
            checker, place = nodes.new("ShaderNodeTexChecker"), nodes.new("ShaderNodeTexCoord")
            links.new(place.outputs["UV"], checker.inputs["Vector"])
            checker.inputs["Scale"].default_value = p.get("uscale", [1.0])[0]
            for name, key in (("Color1", "tex1"), ("Color2", "tex2")):
                checker.inputs[name].default_value = (*p[key], 1)
            return checker.outputs["Color"]
        self.textures[position[0]] = node

    def AreaLightSource(self, _, p):
        self.emission = self.principled("emission", p["L"])

    def LightSource(self, position, p):
        if position[0] != "infinite" or "L" not in p:
            sys.exit(f"pbrt_to_blend: light {position[0]} is not known here")
        world = self.scene.world = bpy.data.worlds.new("surroundings")
        world.use_nodes = True
        world.node_tree.nodes["Background"].inputs["Color"].default_value = (*p["L"], 1)

    # --- shapes --------------------------------------------------------------------------------------------------------

    def Shape(self, position, p):
        mesh = bpy.data.meshes.new(position[0])
        if position[0] == "trianglemesh":
            points, corners = p["P"], [int(i) for i in p["indices"]]
            mesh.from_pydata([points[k:k + 3] for k in range(0, len(points), 3)], [],
                             [corners[k:k + 3] for k in range(0, len(corners), 3)])
            if "uv" in p:
                layer = mesh.uv_layers.new()
                for loop, uv in zip(mesh.loops, layer.data):
                    uv.uv = p["uv"][2 * loop.vertex_index:2 * loop.vertex_index + 2]
        elif position[0] in ("sphere", "cylinder"):
            mesh.from_pydata(*around(position[0], p))
            mesh.polygons.foreach_set("use_smooth", [True] * len(mesh.polygons))
        else:
            sys.exit(f"pbrt_to_blend: shape {position[0]} is not known here")
        mesh.materials.append(self.emission or self.material)
        shape = bpy.data.objects.new(position[0], mesh)
        shape.matrix_world = MIRROR @ self.matrix
        self.scene.collection.objects.link(shape)


def around(kind, p, steps=64):
    """Vertices, edges, faces of a surface of revolution about z."""
    r = p.get("radius", [1.0])[0]
    low, high = p.get("zmin", [-1.0])[0], p.get("zmax", [1.0])[0]
    ring = ([(r * math.sin(a), -r * math.cos(a)) for a in (math.pi * k / 32 for k in range(33))] if kind == "sphere" else
            [(r, low), (r, high)])
    points = [(q * math.cos(b), q * math.sin(b), z) for q, z in ring for b in (2 * math.pi * k / steps for k in range(steps))]
    faces = [(i * steps + k, i * steps + (k + 1) % steps, (i + 1) * steps + (k + 1) % steps, (i + 1) * steps + k)
             for i in range(len(ring) - 1) for k in range(steps)]
    return points, [], faces


arguments = sys.argv[sys.argv.index("--") + 1:]
exporter = Exporter(tuple(int(v) for v in arguments[2].split("x")) if len(arguments) > 2 else None)
exporter.run(Path(arguments[0]))
bpy.ops.wm.save_as_mainfile(filepath=str(Path(arguments[1]).resolve()))
