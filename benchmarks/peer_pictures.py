"""The pictures of `pictures.py` by other programs, each if it is installed.

Milliseconds of CPU of all threads. MuJoCo draws by OpenGL in software (Mesa, EGL), pybullet by
TinyRenderer, riley by its own rasteriser, and embreex intersects rays without a grey value.
"""

import os
import tempfile
import time
from pathlib import Path

import numpy as np

SOFTWARE_GL = {"MUJOCO_GL": "egl", "LP_NUM_THREADS": "0", "OMP_NUM_THREADS": "1"}
for name, value in SOFTWARE_GL.items():
    os.environ.setdefault(name, value)

REPEATS = 40


def least(call, repeats=REPEATS):
    """Milliseconds of CPU of a call: the least and the median."""
    call()
    times = []
    for _ in range(repeats):
        start = time.process_time_ns()
        call()
        times.append(time.process_time_ns() - start)
    return min(times) / 1e6, float(np.median(times)) / 1e6


def opencv(scene):
    """`cv2.warpPerspective` of the poster with linear interpolation, without edges."""
    import cv2

    cv2.setNumThreads(1)
    H = np.array([[1.9, 0.1, 20], [-0.1, 1.9, 20], [1e-4, 1e-4, 1]])
    flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
    return 1, least(lambda: cv2.warpPerspective(scene.grey, H, scene.size, flags=flags), 200)


def mujoco(scene):
    """MuJoCo's OpenGL, with its four samples a pixel."""
    import cv2
    import mujoco as mj

    with tempfile.TemporaryDirectory() as folder:
        cv2.imwrite(f"{folder}/poster.png", np.repeat(scene.grey[..., None], 3, 2))
        T_w_c = np.linalg.inv(scene.poses[0]) @ np.diag([1.0, -1, -1, 1])
        turn = np.zeros(4)
        mj.mju_mat2Quat(turn, T_w_c[:3, :3].ravel())
        ball = np.linalg.inv(scene.poses[0]) @ scene.poses[-1]
        mesh = geom = ""
        if len(scene.triangles):
            _write_obj(Path(folder) / "ball.obj", scene.triangles)
            mesh = f'<mesh name="ball" file="{folder}/ball.obj" inertia="shell"/>'
            at = " ".join(map(str, ball[:3, 3]))
            geom = f'<geom type="mesh" mesh="ball" pos="{at}" rgba=".8 .8 .8 1"/>'
        width, height = scene.size
        fovy = np.degrees(2 * np.arctan(height / 2 / scene.focal))
        model = mj.MjModel.from_xml_string(
            f"""<mujoco><visual><global offwidth="640" offheight="480"/>
            <quality shadowsize="0"/></visual><asset>
            <texture name="t" type="2d" file="{folder}/poster.png"/>
            <material name="m" texture="t" emission="1" specular="0"/>{mesh}</asset><worldbody>
            <geom type="plane" size=".3 .215 .1" material="m" euler="180 0 0"/>{geom}
            <camera name="c" pos="{" ".join(map(str, T_w_c[:3, 3]))}"
            quat="{" ".join(map(str, turn))}" fovy="{fovy}"/></worldbody></mujoco>"""
        )
    data = mj.MjData(model)
    mj.mj_forward(model, data)
    renderer = mj.Renderer(model, height, width)

    def draw():
        renderer.update_scene(data, camera="c")
        return renderer.render()

    assert draw().std() > 5, "MuJoCo does not see the bodies"
    found = least(draw)
    renderer.close()
    return 4, found


def tiny_renderer(scene):
    """TinyRenderer of pybullet."""
    import pybullet as p

    p.connect(p.DIRECT)
    width, height = scene.size
    with tempfile.TemporaryDirectory() as folder:
        wall = Path(folder) / "wall.obj"
        _write_quad(wall, scene.corners)
        shape = p.createVisualShape(p.GEOM_MESH, fileName=str(wall))
        p.createMultiBody(0, -1, shape)
        if len(scene.triangles):
            _write_obj(Path(folder) / "ball.obj", scene.triangles)
            shape = p.createVisualShape(p.GEOM_MESH, fileName=f"{folder}/ball.obj")
            at = (np.linalg.inv(scene.poses[0]) @ scene.poses[-1])[:3, 3]
            p.createMultiBody(0, -1, shape, basePosition=at.tolist())
        view = (np.diag([1.0, -1, -1, 1]) @ scene.poses[0]).T.ravel().tolist()
        far, near = 5.0, 0.1
        projection = np.zeros((4, 4))
        projection[0, 0], projection[1, 1] = 2 * scene.focal / width, 2 * scene.focal / height
        projection[2, 2], projection[3, 2] = -(far + near) / (far - near), -1.0
        projection[2, 3] = -2 * far * near / (far - near)
        options = {"renderer": p.ER_TINY_RENDERER, "shadow": 0}
        options["flags"] = p.ER_NO_SEGMENTATION_MASK
        matrices = view, projection.T.ravel().tolist()
        found = least(lambda: p.getCameraImage(width, height, *matrices, **options), 10)
    p.disconnect()
    return 1, found


def riley(scene):
    """riley with one sample a pixel."""
    import riley as ry

    convention = ry.ConnectConvention(
        ry.EElemType.TRI3, ry.EConnectAxis.ROW, 0, ry.ENodeOrder.RILEY
    )
    shader = ry.TextureShader(
        uvs=np.array([[0, 1], [1, 1], [1, 0], [0, 0]], float),
        texture=np.ascontiguousarray(scene.grey)[None],
    )
    corners = np.ascontiguousarray(scene.corners * [1, -1, 1], float)
    triangles = np.array([[0, 3, 2], [0, 2, 1]], np.int64)
    wall = ry.create_mesh(convention, ry.MeshType.tri3opt, corners, triangles, shader)
    camera = ry.Camera(
        pixels_num=scene.size,
        pixels_size=(1e-5, 1e-5),
        pos_world=(0.0, 0.0, 1.0),
        rot_world=(0.0, 0.0, 0.0),
        roi_cent_world=(0.0, 0.0, 0.0),
        focal_length=scene.focal * 1e-5,
        sub_sample=1,
    )
    options = ry.RasterConfig(
        parallel=1,
        save_strategy=ry.SaveStrategy.memory,
        image_save_mode=ry.ImageSaveMode.grey,
        report=0,
        background_value=128.0,
    )
    return 1, least(lambda: ry.raster([wall], camera, options))


def embreex(scene):
    """embreex: the first triangle that one ray a pixel meets."""
    import trimesh
    from trimesh.ray import ray_pyembree

    wall = trimesh.Trimesh(scene.corners, [[0, 3, 2], [0, 2, 1]], process=False)
    bodies = [wall.apply_transform(scene.poses[0])]
    if len(scene.triangles):
        ball = trimesh.Trimesh(
            scene.triangles.reshape(-1, 3), np.arange(len(scene.triangles) * 3).reshape(-1, 3)
        )
        bodies.append(ball.apply_transform(scene.poses[-1]))
    rays = ray_pyembree.RayMeshIntersector(trimesh.util.concatenate(bodies))
    directions = scene.directions.astype(np.float32)
    origins = np.zeros_like(directions)
    return 1, least(lambda: rays._scene.run(origins, directions), 10)


PEERS = {
    "cv2.warpPerspective": opencv,
    "riley": riley,
    "MuJoCo, GL in software": mujoco,
    "TinyRenderer": tiny_renderer,
    "embreex, only ids": embreex,
}


def measure(scene, names):
    """Yield the name, the samples and the milliseconds of each peer that is there."""
    for name in names:
        try:
            samples, found = PEERS[name](scene)
        except Exception as reason:  # noqa: BLE001 - a peer may fail in many ways, and is left out
            print(f"  {name} is left out: {reason!r:.80}")
        else:
            yield name, samples, found


def _write_obj(path, triangles):
    """Write triangles (n, 3, 3) with the vertices that they share."""
    points, index = np.unique(triangles.reshape(-1, 3).round(12), axis=0, return_inverse=True)
    lines = [f"v {x} {y} {z}" for x, y, z in points.tolist()]
    lines += [f"f {a} {b} {c}" for a, b, c in (index.reshape(-1, 3) + 1).tolist()]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def _write_quad(path, corners):
    """Write a rectangle with texture coordinates."""
    lines = [f"v {x} {y} {z}" for x, y, z in corners.tolist()]
    lines += ["vt 0 1", "vt 1 1", "vt 1 0", "vt 0 0", "vn 0 0 -1"]
    path.write_text("\n".join([*lines, "f 1/1/1 4/4/1 3/3/1", "f 1/1/1 3/3/1 2/2/1"]) + "\n")
