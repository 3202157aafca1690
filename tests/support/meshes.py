"""Small meshes whose fields are known, and instances on them."""

import crossfield as cf
import numpy as np

GOLDEN = (1 + 5**0.5) / 2


def tetrahedron():
    corners = [[1, 1, 1], [-1, 1, -1], [1, -1, -1], [-1, -1, 1]]
    return mesh_of(corners, [[0, 2, 1], [0, 3, 2], [0, 1, 3], [1, 2, 3]])


def icosahedron():
    corners = [
        [0, a, b * GOLDEN][turn:] + [0, a, b * GOLDEN][:turn]
        for turn in range(3)
        for a in (1, -1)
        for b in (1, -1)
    ]
    points = np.array(corners)
    apart = ((points[:, None] - points[None]) ** 2).sum(-1)
    faces = [
        [i, j, k]
        for i in range(12)
        for j in range(i)
        for k in range(j)
        if max(apart[i, j], apart[j, k], apart[k, i]) < 4.1
    ]
    return mesh_of(corners, [outward(face, points) for face in faces])


def outward(face, points):
    i, j, k = face
    turned = np.cross(points[j] - points[i], points[k] - points[i]) @ points[i] < 0
    return [i, k, j] if turned else [i, j, k]


def box(count=1):
    """A cube with 2 count^2 triangles on each side."""
    sides, faces = [], []
    for axis in range(3):
        for end in (0, 1):
            plane, triangles = sheet(count, count)
            side = np.empty((len(plane), 3))
            side[:, axis], side[:, (axis + 1) % 3], side[:, (axis + 2) % 3] = end, *plane.T / count
            faces.append(np.array(triangles)[:, :: 1 if end else -1] + sum(map(len, sides)))
            sides.append(side)
    corners, number = np.unique(np.round(np.concatenate(sides), 9), axis=0, return_inverse=True)
    return mesh_of(corners, number.ravel()[np.concatenate(faces)])


def sheet(columns, rows):
    """Corners (v, 2) and triangles of a grid of squares, the diagonals alternating."""
    corners = np.array([[x, y] for x in range(columns + 1) for y in range(rows + 1)], dtype=float)
    triangles = []
    for x in range(columns):
        for y in range(rows):
            a, d = x * (rows + 1) + y, x * (rows + 1) + y + 1
            b, c = a + rows + 1, d + rows + 1
            triangles += [[a, b, c], [a, c, d]] if (x + y) % 2 else [[a, b, d], [b, c, d]]
    return corners, triangles


def flat_sheet(columns, rows, angle=0.0):
    """A grid of squares in a plane, turned by an angle in it."""
    corners, triangles = sheet(columns, rows)
    turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    return mesh_of(np.c_[corners @ turn, np.zeros(len(corners))], triangles)


def torus(around, across, tube=0.4):
    u, v = np.meshgrid(
        np.arange(around) * 2 * np.pi / around, np.arange(across) * 2 * np.pi / across, indexing="ij"
    )
    points = np.stack(
        [(1 + tube * np.cos(v)) * np.cos(u), (1 + tube * np.cos(v)) * np.sin(u), tube * np.sin(v)], axis=-1
    )
    faces = []
    for x in range(around):
        for y in range(across):
            a, b = x * across + y, (x + 1) % around * across + y
            c, d = (x + 1) % around * across + (y + 1) % across, x * across + (y + 1) % across
            faces += [[a, b, c], [a, c, d]]
    return mesh_of(points.reshape(-1, 3), faces)


def mesh_of(corners, faces):
    return cf.Mesh(np.array(corners, dtype=float), np.array(faces, dtype=np.int32))


def on_edges(mesh, sharp=0.6, boundary=True, name="part", **more):
    """An instance with strokes along edges whose normals differ by more than `sharp` and on the boundary."""
    at = np.nonzero(mesh.dihedral > sharp)[0]
    faces = np.concatenate([mesh.first[at], mesh.second[at], mesh.boundary // 3 if boundary else []])
    low, high = mesh.vertices[mesh.pair_vertices[at]].transpose(1, 0, 2)
    start, end = mesh.vertices[mesh.edge_vertices(mesh.boundary)].transpose(1, 0, 2)
    along = [high - low, high - low, *([end - start] if boundary else [])]
    return on_directions(mesh, faces.astype(np.int32), np.concatenate(along), name=name, **more)


def on_directions(mesh, faces, vectors, name="part", **more):
    """An instance with strokes along vectors: the first one of each face."""
    unique, at = np.unique(faces, return_index=True)
    theta = mesh.angle_in(unique, np.asarray(vectors)[at]) if len(unique) else np.zeros(0)
    weight = {"stroke_coefficient": 20.0} | more
    return cf.Instance.on_faces(name, mesh, unique.astype(np.int32), theta, np.ones(len(unique)), **weight)


def write_obj(path, mesh, *more):
    """An .obj of the mesh, as a program would write it that also has normals and texture."""
    lines = ["# a mesh", "vt 0 0", "vn 0 0 1", "o part"]
    lines += [f"v {x!r} {y!r} {z!r}" for x, y, z in mesh.vertices.tolist()]
    lines += [f"f {a + 1}/1/1 {b + 1}//1 {c + 1}" for a, b, c in mesh.faces.tolist()]
    path.write_text("\n".join([*lines, *more]) + "\n")
    return path
