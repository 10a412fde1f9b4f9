"""Small mesh files whose scenes are huge, and COLLADA files that define entities in disguise."""

import json
import struct

import numpy as np

NAMESPACE = 'xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1"'
HEAD = '<?xml version="1.0"?>'
UNIT = "<asset><unit meter='1'/></asset>"
GEOMETRY = """<library_geometries><geometry id="g"><mesh><source id="p">
<float_array id="a" count="9">0 0 0 1 0 0 0 1 0</float_array><technique_common>
<accessor source="#a" count="3" stride="3"><param name="X" type="float"/>
<param name="Y" type="float"/><param name="Z" type="float"/></accessor></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
<triangles count="1"><input semantic="VERTEX" source="#v" offset="0"/><p>0 1 2</p></triangles>
</mesh></geometry></library_geometries>"""
SCENE = '<scene><instance_visual_scene url="#s"/></scene>'


def collada(nodes, library=""):
    """Return a COLLADA file of one triangle that the nodes of its scene show."""
    scene = f'<visual_scene id="s">{nodes}</visual_scene>'
    content = f"{GEOMETRY}<library_nodes>{library}</library_nodes>" if library else GEOMETRY
    content += f"<library_visual_scenes>{scene}</library_visual_scenes>{SCENE}"
    return f"{HEAD}<COLLADA {NAMESPACE}>{UNIT}{content}</COLLADA>".encode()


def nest_instances(levels, copies=2):
    """Return a file of nodes that each show the next node some times: copies^levels triangles."""
    own = "<node id='n0'><instance_geometry url='#g'/></node>"
    for i in range(levels):
        inner = f"<instance_node url='#n{i}'/>" * copies
        own += f"<node id='n{i + 1}'>{inner}</node>"
    return collada(f"<node><instance_node url='#n{levels}'/></node>", own)


def group_triangles(count):
    """Return an OBJ file with a group for each triangle."""
    return b"v 0 0 0\nv 1 0 0\nv 0 1 0\n" + b"".join(
        b"g %d\nusemtl %d\nf 1 2 3\n" % (i, i) for i in range(count)
    )


def glb(tree, data):
    """Return a binary GLTF file."""
    text = json.dumps(tree, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text
    chunks += struct.pack("<I4s", len(data), b"BIN\0") + data
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def make_tree(nodes, count=3, triangles=1):
    """Return the description of a scene of nodes that show the same triangles, and its data."""
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], "<f4").tobytes()
    indices = np.tile(np.arange(3, dtype="<u2"), triangles).tobytes()
    indices += b"\0" * (-len(indices) % 4)
    sizes = len(points), len(indices)
    return {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": list(range(len(nodes)))}],
        "nodes": nodes,
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": count, "type": "VEC3"},
            {"bufferView": 1, "componentType": 5123, "count": 3 * triangles, "type": "SCALAR"},
        ],
        "bufferViews": [
            {"buffer": 0, "byteOffset": 0, "byteLength": sizes[0]},
            {"buffer": 0, "byteOffset": sizes[0], "byteLength": sizes[1]},
        ],
        "buffers": [{"byteLength": sum(sizes)}],
    }, points + indices


def repeat_nodes(count, triangles=1):
    """Return a GLB file of a scene with many nodes."""
    return glb(*make_tree([{"mesh": 0}] * count, triangles=triangles))


def nest_nodes(levels, copies=2):
    """Return a GLB file of nodes that each have the next node as a child some times."""
    tree, data = make_tree([{"mesh": 0}])
    tree["nodes"] += [{"children": [i] * copies} for i in range(levels)]
    tree["scenes"][0]["nodes"] = [levels]
    return glb(tree, data)


def count_without_data(count):
    """Return a GLB file of accessors without data, which are filled with zeros."""
    tree, data = make_tree([{"mesh": 0}])
    for accessor, number in zip(tree["accessors"], (count, 3 * count), strict=True):
        accessor["count"] = number
        del accessor["bufferView"]
    return glb(tree, data)


def define_entities(levels=9):
    """Return a document type whose last entity is 10^levels characters long."""
    own = '<!ENTITY e0 "aaaaaaaaaa">'
    own += "".join(f'<!ENTITY e{i + 1} "{f"&e{i};" * 10}">' for i in range(levels))
    return f"<!DOCTYPE COLLADA [{own}]>"


def disguise_entities(encoding):
    """Return a COLLADA file with entities in an encoding that is declared behind much space."""
    head = f'<?xml version="1.0"{" " * 300} encoding="{encoding}"?>'
    text = f"{define_entities()}<COLLADA {NAMESPACE}>{UNIT}<a>&e8;</a></COLLADA>"
    content = text.encode(encoding)
    return head.encode() + (content.replace(b"<", b"+ADw-") if encoding == "utf-7" else content)


HOSTILE = {
    "instances.dae": lambda: nest_instances(24),
    "many_instances.dae": lambda: nest_instances(3, 60),
    "cycle.dae": lambda: collada(
        "<node><instance_node url='#a'/></node>",
        "".join(f"<node id='{a}'><instance_node url='#{b}'/></node>" for a, b in ("ab", "ba")),
    ),
    "deep.dae": lambda: collada("<node>" * 20_000 + "</node>" * 20_000),
    "empty_nodes.dae": lambda: collada("<node><instance_geometry url='#g'/></node>" * 80_000),
    "groups.obj": lambda: group_triangles(150_000),
    "nodes.glb": lambda: repeat_nodes(200_000),
    "nested.glb": lambda: nest_nodes(28),
    "deep.glb": lambda: nest_nodes(50_000, 1),
    "counts.glb": lambda: count_without_data(200_000_000),
    "huge_counts.glb": lambda: count_without_data(2_000_000_000),
    "copies.glb": lambda: repeat_nodes(20_000, triangles=50_000),
    "utf-7.dae": lambda: disguise_entities("utf-7"),
    "entities.dae": lambda: disguise_entities("utf-8"),
    "padded.dae": lambda: disguise_entities("utf-16-le"),
}
