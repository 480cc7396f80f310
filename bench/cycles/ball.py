# SPDX-License-Identifier: MIT
# The scene ball.toml by Blender's Cycles, every particle a sphere with subsurface scattering of its own:
#   blender -b --factory-startup -noaudio -t 2 --python bench/cycles/ball.py -- SAMPLES SEED OUT.exr
# Prints the seconds that the render took, the upload of the scene included.
import math
import random
import sys
import time

import bpy

samples, seed, out = int(sys.argv[-3]), int(sys.argv[-2]), sys.argv[-1]
RADIUS, ACROSS = 0.15, 124  # as ball.toml: 8 particles a cell are 124 across the ball

bpy.ops.wm.read_factory_settings(use_empty=True)
scene = bpy.context.scene

# The particles: one at a random place in each cell of a cubic lattice, as firn places them.
spacing = 2 * RADIUS / ACROSS
generator = random.Random(1)
points = []
for i in range(ACROSS):
    for j in range(ACROSS):
        for k in range(ACROSS):
            p = [-RADIUS + (n + generator.random()) * spacing for n in (i, j, k)]
            if p[0] * p[0] + p[1] * p[1] + p[2] * p[2] < RADIUS * RADIUS:
                points.append(p)
print(f"particles {len(points)}")

material = bpy.data.materials.new("snow")
material.use_nodes = True
principled = material.node_tree.nodes["Principled BSDF"]
principled.inputs["Base Color"].default_value = (0.93, 0.95, 0.97, 1)
principled.inputs["Subsurface"].default_value = 1
principled.inputs["Subsurface Color"].default_value = (0.93, 0.95, 0.97, 1)
principled.inputs["Subsurface Radius"].default_value = (0.009, 0.009, 0.009)
principled.inputs["Specular"].default_value = 0
principled.inputs["Roughness"].default_value = 1

mesh = bpy.data.meshes.new("particles")
mesh.from_pydata(points, [], [])
ball = bpy.data.objects.new("particles", mesh)
scene.collection.objects.link(ball)
nodes = bpy.data.node_groups.new("points", "GeometryNodeTree")
nodes.inputs.new("NodeSocketGeometry", "Geometry")
nodes.outputs.new("NodeSocketGeometry", "Geometry")
begin, end = nodes.nodes.new("NodeGroupInput"), nodes.nodes.new("NodeGroupOutput")
to_points = nodes.nodes.new("GeometryNodeMeshToPoints")
to_points.inputs["Radius"].default_value = 0.6 * spacing
paint = nodes.nodes.new("GeometryNodeSetMaterial")
paint.inputs["Material"].default_value = material
nodes.links.new(begin.outputs[0], to_points.inputs["Mesh"])
nodes.links.new(to_points.outputs[0], paint.inputs["Geometry"])
nodes.links.new(paint.outputs[0], end.inputs[0])
ball.modifiers.new("points", "NODES").node_group = nodes

# Lights and camera of ball.toml; Blender's z is up: (x, y, z) there is (x, -z, y) here.
azimuth, elevation = math.radians(60), math.radians(35)
sun = bpy.data.objects.new("sun", bpy.data.lights.new("sun", "SUN"))
sun.data.energy, sun.data.angle = 2.5, math.radians(0.533)
sun.rotation_euler = (math.pi / 2 - elevation, 0, azimuth)
scene.collection.objects.link(sun)
scene.world = bpy.data.worlds.new("sky")
scene.world.use_nodes = True
scene.world.node_tree.nodes["Background"].inputs["Color"].default_value = (0.25, 0.32, 0.45, 1)

camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
camera.location, camera.rotation_euler = (0, -0.9, 0), (math.pi / 2, 0, 0)
camera.data.sensor_fit, camera.data.angle = "VERTICAL", math.radians(26)
scene.collection.objects.link(camera)
scene.camera = camera

scene.render.engine = "CYCLES"
scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = 640, 480, 100
scene.cycles.device = "CPU"
scene.cycles.samples = samples
scene.cycles.use_adaptive_sampling = False
scene.cycles.use_denoising = False
scene.cycles.pixel_filter_type = "BOX"
scene.cycles.seed = seed
scene.render.image_settings.file_format = "OPEN_EXR"
scene.render.image_settings.color_depth = "32"
scene.render.image_settings.exr_codec = "NONE"
scene.render.filepath = out
started = time.time()
bpy.ops.render.render(write_still=True)
print(f"seconds {time.time() - started:.1f}")
