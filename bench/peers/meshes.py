# SPDX-License-Identifier: Apache-2.0
"""Fine meshes and large pictures for the benches beside Mitsuba 3."""
import numpy as np


def ball(path, rows, bumps=0.02):
    """A bumpy ball of radius about 1 with normals and uv as binary PLY; its 4 rows (rows - 1) triangles."""
    columns = 2 * rows
    theta = np.pi * np.linspace(0, 1, rows + 1)[:, None]
    phi = 2 * np.pi * np.linspace(0, 1, columns + 1)[None, :]
    r = 1 + bumps * np.sin(40 * theta) * np.cos(40 * phi) * np.sin(theta)
    p = np.stack([r * np.sin(theta) * np.cos(phi), r * np.sin(theta) * np.sin(phi), r * np.cos(theta)], -1)
    p[:, -1] = p[:, 0]
    normal = np.cross(np.gradient(p, axis=0), np.gradient(p, axis=1))
    normal[0], normal[-1] = (0, 0, 1), (0, 0, -1)
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    uv = np.stack(np.broadcast_arrays(phi / (2 * np.pi), 1 - theta / np.pi), -1)
    vertices = np.concatenate([p, normal, uv], -1).reshape(-1, 8).astype("<f4")
    a = np.arange(rows)[:, None] * (columns + 1) + np.arange(columns)[None, :]
    b, c, d = a + 1, a + columns + 1, a + columns + 2
    faces = np.concatenate([np.stack([a, c, d], -1)[:-1].reshape(-1, 3), np.stack([a, d, b], -1)[1:].reshape(-1, 3)])
    table = np.empty(len(faces), dtype=[("n", "u1"), ("v", "<i4", 3)])
    table["n"], table["v"] = 3, faces
    names = ("x", "y", "z", "nx", "ny", "nz", "u", "v")
    with open(path, "wb") as file:
        file.write(("ply\nformat binary_little_endian 1.0\nelement vertex %d\n" % len(vertices)
                    + "".join("property float %s\n" % name for name in names)
                    + "element face %d\nproperty list uchar int vertex_indices\nend_header\n" % len(faces)).encode())
        file.write(vertices.tobytes())
        file.write(table.tobytes())
    return len(faces)


def picture(path, height, width, seed):
    """Random colours as a PFM."""
    rgb = np.random.default_rng(seed).uniform(0.1, 0.9, (height, width, 3)).astype("<f4")
    with open(path, "wb") as file:
        file.write(b"PF\n%d %d\n-1.0\n" % (width, height))
        file.write(rgb.tobytes())
