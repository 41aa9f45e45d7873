"""Models assets/modules/reef.seaweed/sea-palm.glb with Blender, and writes it with Blender's own exporter.

    pip install bpy
    python tools/blender/sea_palm.py OUT.glb

A sea palm (Postelsia palmaeformis): a stipe of four bones, and eight blades of three bones each that droop
from its top. It is modelled at twice its size, and its armature is moved, turned and scaled, as people leave
theirs: what the exporter writes has a hierarchy that is not at the origin.
"""

import math
import sys

import bpy
from mathutils import Vector

# Modelled over real.
MODELLED = 2.0
STIPE_BONES, STIPE_LENGTH = 4, 0.62
BLADES, BLADE_BONES, BLADE_LENGTH, BLADE_WIDTH = 8, 3, 0.5, 0.085
GOLDEN_ANGLE = math.radians(137.507764)


def bone(edit, name, head, tail, parent, connected):
    new = edit.new(name)
    new.head, new.tail = head * MODELLED, tail * MODELLED
    new.parent, new.use_connect = parent, connected
    return new


def blade_points(number):
    """The middle line of a blade: out of the top, then down."""
    turn = GOLDEN_ANGLE * number
    out = Vector((math.cos(turn), math.sin(turn), 0.0))
    rise = 0.9 - 0.6 * (number / BLADES)
    point = stipe_points()[-1] - Vector((0.0, 0.0, 0.01)) + out * 0.012
    points, angle = [point], rise
    for _ in range(BLADE_BONES):
        step = BLADE_LENGTH * (0.85 + 0.3 * ((number * 7) % 5) / 4) / BLADE_BONES
        point = point + (out * math.cos(angle) + Vector((0, 0, 1)) * math.sin(angle)) * step
        points.append(point)
        angle -= 0.62
    return out, points


def stipe_points():
    """The middle line of the stipe, a little bent."""
    shares = [i / STIPE_BONES for i in range(STIPE_BONES + 1)]
    return [Vector((0.02 * math.sin(2.2 * t), 0.0, STIPE_LENGTH * t)) for t in shares]


def skeleton():
    armature = bpy.data.objects.new("Sea palm", bpy.data.armatures.new("Sea palm"))
    bpy.context.collection.objects.link(armature)
    bpy.context.view_layer.objects.active = armature
    bpy.ops.object.mode_set(mode="EDIT")
    edit, points, last = armature.data.edit_bones, stipe_points(), None
    for i in range(STIPE_BONES):
        last = bone(edit, f"stipe.{i}", points[i], points[i + 1], last, i > 0)
    for number in range(BLADES):
        _, points = blade_points(number)
        below = last
        for i in range(BLADE_BONES):
            below = bone(edit, f"blade.{number}.{i}", points[i], points[i + 1], below, i > 0)
    bpy.ops.object.mode_set(mode="OBJECT")
    return armature


class Draft:
    def __init__(self):
        self.places, self.uvs, self.colors, self.weights, self.faces = [], [], [], [], []

    def vertex(self, place, uv, color, weights):
        self.places.append(place)
        self.uvs.append(uv)
        self.colors.append(color)
        self.weights.append(weights)
        return len(self.places) - 1

    def rows(self, first, rows, columns):
        for row in range(rows):
            for column in range(columns):
                a = first + row * (columns + 1) + column
                b = a + columns + 1
                self.faces.append((a, a + 1, b + 1, b))


def along(points, t):
    """Place on a smooth curve through bones' ends (Catmull and Rom's), its way, number of bone, share of it."""
    at = min(int(t * (len(points) - 1)), len(points) - 2)
    f = t * (len(points) - 1) - at
    b, c = points[at], points[at + 1]
    a = points[at - 1] if at > 0 else b + (b - c)
    d = points[at + 2] if at + 2 < len(points) else c + (c - b)
    place = b + ((c - a) + ((2 * a - 5 * b + 4 * c - d) + (3 * (b - c) + d - a) * f) * f) * (0.5 * f)
    way = (c - a) + ((2 * a - 5 * b + 4 * c - d) * 2 + (3 * (b - c) + d - a) * (3 * f)) * f
    return place, way.normalized(), at, f


def hang(name, count, at, f):
    """Half to the neighbour at a joint, alone in the middle of a bone."""
    other = at + 1 if f > 0.5 else at - 1
    share = abs(f - 0.5)
    if not 0 <= other < count:
        return {f"{name}.{at}": 1.0}
    return {f"{name}.{at}": 1.0 - share, f"{name}.{other}": share}


def stipe(draft):
    points, rows, sides = stipe_points(), 7, 6
    first = len(draft.places)
    for row in range(rows + 1):
        t = row / rows
        place, _, at, f = along(points, t)
        radius = 0.021 - 0.008 * t + 0.03 * max(0.0, 1.0 - 9.0 * t) ** 2
        for side in range(sides + 1):
            turn = 2.0 * math.pi * side / sides
            off = Vector((math.cos(turn), math.sin(turn), 0.0)) * radius
            shade = 0.75 + 0.25 * t
            weights = hang("stipe", STIPE_BONES, at, f)
            draft.vertex(place + off, (side / sides, 0.1 * t), (shade, shade, shade, 1.0), weights)
    draft.rows(first, rows, sides)


def blade(draft, number):
    out, points = blade_points(number)
    rows, columns, first = 7, 2, len(draft.places)
    aside = Vector((-out.y, out.x, 0.0))
    for row in range(rows + 1):
        t = row / rows
        place, way, at, f = along(points, t)
        half = 0.5 * BLADE_WIDTH * min(1.0, 0.22 + 2.2 * t) * max(0.06, 1.0 - t**4)
        for column in range(columns + 1):
            u = 2.0 * column / columns - 1.0
            # A groove along the middle, and edges that wave a little.
            lift = 0.012 * (abs(u) - 0.5) + 0.008 * u * math.sin(9.0 * t + number)
            shade = 0.8 + 0.2 * abs(u)
            draft.vertex(
                place + aside * (half * u) + aside.cross(way) * -lift,
                (0.5 + 0.5 * u, t),
                (shade, shade, 0.95 * shade, 1.0),
                hang(f"blade.{number}", BLADE_BONES, at, f),
            )
    draft.rows(first, rows, columns)


def skin(armature):
    draft = Draft()
    stipe(draft)
    for number in range(BLADES):
        blade(draft, number)
    mesh = bpy.data.meshes.new("Sea palm")
    mesh.from_pydata([place * MODELLED for place in draft.places], [], draft.faces)
    for polygon in mesh.polygons:
        polygon.use_smooth = True
    layer = mesh.uv_layers.new(name="UV")
    for loop in mesh.loops:
        layer.data[loop.index].uv = draft.uvs[loop.vertex_index]
    colors = mesh.color_attributes.new("Color", "BYTE_COLOR", "POINT")
    for i, color in enumerate(draft.colors):
        colors.data[i].color = color
    thing = bpy.data.objects.new("Sea palm's skin", mesh)
    bpy.context.collection.objects.link(thing)
    for i, weights in enumerate(draft.weights):
        for name, weight in weights.items():
            group = thing.vertex_groups.get(name) or thing.vertex_groups.new(name=name)
            group.add([i], weight, "REPLACE")
    thing.parent = armature
    thing.modifiers.new("Armature", "ARMATURE").object = armature
    return thing


def main(path):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    armature = skeleton()
    skin(armature)
    armature.location, armature.rotation_euler.z, armature.scale = (0.3, -0.2, 0.1), 0.5, [1.0 / MODELLED] * 3
    bpy.ops.export_scene.gltf(
        filepath=path,
        export_format="GLB",
        export_yup=True,
        export_skins=True,
        export_materials="NONE",
        export_animations=False,
        export_vertex_color="ACTIVE",
    )


main(sys.argv[-1])
