"""Blender, headless: render scenes/cornell-box.pbrt's geometry with Cycles on the CPU and print the
processor seconds that it took.

  blender -b --factory-startup --python scripts/hosts/cycles_box.py -- SCENE.pbrt SPP THREADS OUT.png
"""
import re
import sys
import time

import bpy
from mathutils import Matrix

scene_file, spp, threads, out = sys.argv[sys.argv.index("--") + 1:]
text = re.sub(r"#.*", "", open(scene_file).read())

bpy.ops.wm.read_factory_settings(use_empty=True)
scene = bpy.context.scene
colours = {m[0]: [float(x) for x in m[1].split()] for m in
           re.findall(r'MakeNamedMaterial "(\w+)".*?"rgb reflectance" \[([^\]]*)\]', text)}


def material(name, colour, strength=0.0):
    m = bpy.data.materials.new(name)
    m.use_nodes = True
    nodes, links = m.node_tree.nodes, m.node_tree.links
    nodes.clear()
    output = nodes.new("ShaderNodeOutputMaterial")
    shader = nodes.new("ShaderNodeEmission" if strength else "ShaderNodeBsdfDiffuse")
    shader.inputs["Color"].default_value = colour + [1.0]
    if strength:
        shader.inputs["Strength"].default_value = strength
    links.new(shader.outputs[0], output.inputs["Surface"])
    return m


materials = {name: material(name, colour) for name, colour in colours.items()}
current, emission = None, None
for token in re.finditer(r'AreaLightSource[^\n]*"rgb L" \[([^\]]*)\]|AttributeEnd|(?<!Make)NamedMaterial "(\w+)"|'
                         r'"integer indices" \[([^\]]*)\]\s*"point3 P" \[([^\]]*)\]', text):
    if token[0] == "AttributeEnd":
        emission = None
    elif token[1]:
        emission = [float(x) for x in token[1].split()]
    elif token[2]:
        current = materials[token[2]]
    else:
        i, p = [int(x) for x in token[3].split()], [float(x) for x in token[4].split()]
        mesh = bpy.data.meshes.new("part")
        mesh.from_pydata([p[k:k + 3] for k in range(0, len(p), 3)], [], [i[k:k + 3] for k in range(0, len(i), 3)])
        if emission:
            mesh.materials.append(material("light", [c / max(emission) for c in emission], max(emission)))
        else:
            mesh.materials.append(current)
        scene.collection.objects.link(bpy.data.objects.new("part", mesh))

camera = bpy.data.cameras.new("camera")
camera.angle = 39.3 * 3.14159265 / 180.0
camera.clip_end = 1e5
eye = bpy.data.objects.new("camera", camera)
# looks along +z with +y up: Blender's camera looks along -z, so turn it about y
eye.matrix_world = Matrix(((-1, 0, 0, 278), (0, 1, 0, 273), (0, 0, -1, -800), (0, 0, 0, 1)))
scene.collection.objects.link(eye)
scene.camera = eye

render = scene.render
render.engine = "CYCLES"
render.resolution_x = render.resolution_y = 400
render.resolution_percentage = 100
render.threads_mode = "FIXED"
render.threads = int(threads)
render.filepath = out
cycles = scene.cycles
cycles.device = "CPU"
cycles.samples = int(spp)
cycles.use_adaptive_sampling = False
cycles.use_denoising = False
cycles.max_bounces = cycles.diffuse_bounces = 8
cycles.caustics_reflective = cycles.caustics_refractive = False
start = time.process_time()
bpy.ops.render.render(write_still=True)
print("CYCLES_CPU_SECONDS %.4f" % (time.process_time() - start))
