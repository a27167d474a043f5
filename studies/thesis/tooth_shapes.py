"""Crowns for pictures: the bundled incisor, a canine, a molar, six front teeth in an arch, and a stained incisor. Lengths in
mm; +y towards the biting edge, +z towards the lips."""
import math
import shutil

import numpy as np

from make_peer_captures import crown, shell, turn, write_ply


def canine(n=96, levels=64):
    """Superelliptic sections that run into one blunt tip."""
    rings = []
    for u in 0.5 - 0.5 * np.cos(math.pi * np.arange(1, levels) / levels):
        narrowing = (1 - max(0.0, u - 0.45) ** 1.6 / 0.55 ** 1.6 * 0.93)
        cap = (1 - abs(2 * u - 1) ** 10) ** 0.5
        angle = -2 * math.pi * np.arange(n) / n
        c, t = np.cos(angle), np.sin(angle)
        r = cap * (np.abs(c) ** 2.3 + np.abs(t) ** 2.3) ** (-1 / 2.3)
        rings.append(np.stack([(3.2 + 0.7 * math.sin(math.pi * min(1, 1.3 * u))) * narrowing * r * c, np.full(n, 10.5 * (u - 0.5)),
                               0.5 * math.sin(math.pi * u) + (3.3 - 0.4 * u) * narrowing * r * t], axis=1))
    return shell(rings, (0, -5.25, 0), (0, 5.25, 0.5 * math.sin(math.pi)))


def molar(n=128, side=28, top=40):
    """A rounded block, 10.5 x 10 x 7.5 mm, with four cusps, a fossa and a cross of fissures."""
    angle = -2 * math.pi * np.arange(n) / n
    c, t = np.cos(angle), np.sin(angle)
    outline = (np.abs(c) ** 3 + np.abs(t) ** 3) ** (-1 / 3)
    height = lambda r: 2.6 + (1.15 * np.exp(-((r - 0.62) / 0.24) ** 2) * np.sin(2 * angle) ** 2 - 1.3 * np.exp(-(r / 0.42) ** 2) - 1.0 * r ** 6)
    rings = []
    for u in np.arange(1, side) / side:  # from the neck up to the rim
        bulge = (1 - (1 - u) ** 8) ** 0.5 * (0.9 + 0.1 * math.sin(math.pi * u))
        rings.append(np.stack([5.25 * bulge * outline * c, -4.2 + (height(1.0) + 4.2) * u, 5.0 * bulge * outline * t], axis=1))
    for r in 1 - np.arange(0, top) / top:
        rings.append(np.stack([4.725 * r * outline * c, height(r), 4.5 * r * outline * t], axis=1))
    return shell(rings, (0, -4.2, 0), (0, float(height(0.0)[0]), 0))


def front_teeth():
    """Two central incisors, two lateral ones, two canines along an arch, 0.15 mm apart, as one mesh of six parts."""
    vertices, faces, at, turned = [], [], np.zeros(2), 0.0  # at: x and z of the arch, followed to the right
    for mesh, scale in ((crown(0), 1.0), (crown(0), 0.82), (canine(), 0.95)):
        v = mesh[0] * scale
        width = np.ptp(v[:, 0]) + 0.15
        turned += 0.5 * math.radians(1.6 * width)
        step = width * np.array([math.cos(turned), -math.sin(turned)])
        middle = at + 0.5 * step
        placed = v @ turn(math.degrees(turned), 1).T + np.array([middle[0], -0.5 * np.ptp(v[:, 1]) + 5, middle[1]])
        for side in (1, -1):
            faces.append(mesh[1][:, ::side] + sum(len(x) for x in vertices))
            vertices.append(placed * [side, -1, 1] @ np.diag([1.0, 1, 1]))
        at, turned = at + step, turned + 0.5 * math.radians(1.6 * width)
    faces = [f[:, ::-1] for f in faces]  # upper teeth hang: mirrored in y
    return np.concatenate(vertices), np.concatenate(faces)


def read_ply(path):
    """Vertices and triangles of a binary PLY as crownfit writes it."""
    header, body = path.read_bytes().split(b"end_header\n", 1)
    counts = [int(line.split()[-1]) for line in header.decode().splitlines() if line.startswith("element")]
    vertices = np.frombuffer(body, "<f4", 3 * counts[0]).reshape(-1, 3).astype(float)
    faces = np.frombuffer(body, np.dtype([("n", "u1"), ("v", "<i4", 3)]), counts[1], 12 * counts[0])["v"]
    return vertices, faces


def stain(v):
    """Factor on absorption at the vertices: a brown band at the neck, two vertical stripes, one chalky spot without."""
    x, y = v[:, 0], v[:, 1]
    band = 25 * np.exp(-((y + 4.0) / 0.7) ** 2)
    stripes = 10 * (np.exp(-((x - 1.3) / 0.25) ** 2) + np.exp(-((x + 1.3) / 0.25) ** 2)) * np.clip((y + 1) / 3, 0, 1)
    return 1 + (band + stripes)


def write_all(folder, incisor):
    shutil.copyfile(incisor, folder / "incisor.ply")
    write_ply(folder / "canine.ply", canine())
    vertices, faces = molar()
    write_ply(folder / "molar.ply", (vertices @ turn(50, 0).T, faces))  # its biting surface towards the camera
    write_ply(folder / "front_teeth.ply", front_teeth())
    vertices, faces = read_ply(incisor)
    extra = stain(vertices) - 1
    with open(folder / "stained.ply", "w") as file:
        names = "".join(f"property float {name}\n" for name in ("x", "y", "z", "stain_r", "stain_g", "stain_b"))
        file.write(f"ply\nformat ascii 1.0\nelement vertex {len(vertices)}\n{names}element face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n")
        for v, e in zip(vertices, extra):
            file.write(" ".join(f"{x:.6g}" for x in (*v, 1 + 1.0 * e, 1 + 1.3 * e, 1 + 1.6 * e)) + "\n")
        for f in faces:
            file.write("3 " + " ".join(map(str, f)) + "\n")
