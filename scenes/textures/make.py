#!/usr/bin/env python3
"""Draws the textures and meshes of our scenes. Needs nothing but Python; the results are kept in the repository."""
import math, os, random, struct, zlib

here = os.path.dirname(os.path.abspath(__file__))
random.seed(20)


def png(name, width, height, channels, pixel):
    rows = b''.join(b'\0' + b''.join(bytes(max(0, min(255, int(c * 255 + 0.5))) for c in pixel(x, y)) for x in range(width))
                    for y in range(height))
    chunk = lambda kind, data: struct.pack('>I', len(data)) + kind + data + struct.pack('>I', zlib.crc32(kind + data))
    with open(os.path.join(here, name), 'wb') as f:
        f.write(b'\x89PNG\r\n\x1a\n' + chunk(b'IHDR', struct.pack('>IIBBBBB', width, height, 8, {1: 0, 3: 2, 4: 6}[channels], 0, 0, 0))
                + chunk(b'IDAT', zlib.compress(rows, 9)) + chunk(b'IEND', b''))


def lattice(n):
    return [[random.random() for _ in range(n)] for _ in range(n)]


GRIDS = [lattice(8), lattice(16), lattice(32), lattice(64)]


def noise(u, v):
    """Fractal value noise in [0, 1], periodic over the unit square."""
    total = weight = 0
    for k, g in enumerate(GRIDS):
        n = len(g)
        x, y = u * n % n, v * n % n
        i, j = int(x), int(y)
        fx, fy = x - i, y - j
        fx, fy = fx * fx * (3 - 2 * fx), fy * fy * (3 - 2 * fy)
        a = g[j % n][i % n] * (1 - fx) + g[j % n][(i + 1) % n] * fx
        b = g[(j + 1) % n][i % n] * (1 - fx) + g[(j + 1) % n][(i + 1) % n] * fx
        total += (a * (1 - fy) + b * fy) / 2 ** k
        weight += 1 / 2 ** k
    return total / weight


def brick(x, y, n=128):
    """Brick number and distance from its edge in pixels."""
    row = y // 16
    shifted = (x + 16 * (row % 2)) % n
    return (row, shifted // 32), min(shifted % 32, 31 - shifted % 32, y % 16, 15 - y % 16)


shade = {}


def bricks(x, y):
    key, edge = brick(x, y)
    tone = shade.setdefault(key, random.uniform(0.75, 1.1)) * (0.85 + 0.3 * noise(x / 128, y / 128))
    return (0.62, 0.6, 0.57) if edge < 1 else (0.66 * tone, 0.33 * tone, 0.24 * tone)


def planks(x, y):
    board = y // 16
    grain = noise((x / 128 + board * 0.37) % 1 * 0.5, (y / 128 * 3 + board * 0.13) % 1)
    tone = shade.setdefault(('p', board), random.uniform(0.8, 1.1)) * (0.7 + 0.5 * grain)
    return tuple(c * tone * (0.55 if y % 16 == 0 else 1) for c in (0.64, 0.46, 0.29))


def leaf(x, y):
    """A leaf with its outline in alpha."""
    u, v = (x + 0.5) / 64 - 0.5, (y + 0.5) / 64
    half = 0.42 * math.sin(math.pi * min(max(v, 0), 1)) ** 0.8
    vein = abs(u) < 0.015 or abs((v * 8 + abs(u) * 10) % 1 - 0.5) < 0.06
    green = (0.35, 0.55, 0.2) if vein else (0.2, 0.45 + 0.1 * noise(x / 64, y / 64), 0.12)
    return green + (1.0 if abs(u) < half else 0.0,)


def dents(x, y):
    u, v = x / 128, y / 128
    return (noise(u, v),)


def normals(x, y):
    n = 64
    h = lambda a, b: 0.5 + 0.5 * math.cos(2 * math.pi * 4 * a / n) * math.cos(2 * math.pi * 4 * b / n)
    dx, dy = (h(x + 1, y) - h(x - 1, y)) * 4, -(h(x, y + 1) - h(x, y - 1)) * 4
    s = 1 / math.sqrt(dx * dx + dy * dy + 1)
    return (0.5 - dx * s / 2, 0.5 - dy * s / 2, 0.5 + s / 2)


png('bricks.png', 128, 128, 3, bricks)
png('planks.png', 128, 128, 3, planks)
png('leaf.png', 64, 64, 4, leaf)
png('dents.png', 128, 128, 1, dents)
png('waves-normal.png', 64, 64, 3, normals)


def pfm(name, width, height, pixel):
    with open(os.path.join(here, name), 'wb') as f:
        f.write(b'PF\n%d %d\n-1.0\n' % (width, height))
        for y in reversed(range(height)):
            for x in range(width):
                f.write(struct.pack('<3f', *pixel(x, y)))


def sky(direction):
    """Clear sky with a small sun over brown ground, z up."""
    x, y, z = direction
    sun = (0.55, -0.5, 0.67)
    c = (x * sun[0] + y * sun[1] + z * sun[2]) / math.sqrt(sum(s * s for s in sun))
    if z < 0:
        return (0.12, 0.1, 0.08)
    t = z ** 0.5
    base = [0.9 - 0.65 * t, 0.95 - 0.5 * t, 1.0 - 0.15 * t]
    glow = math.exp((c - 1) * 60) * 3 + (300 if c > 0.9965 else 0)
    return tuple(b + glow * w for b, w in zip(base, (1, 0.92, 0.78)))


def latlong(x, y, w=64, h=32):
    phi, theta = 2 * math.pi * (x + 0.5) / w, math.pi * (y + 0.5) / h
    return sky((math.sin(theta) * math.cos(phi), math.sin(theta) * math.sin(phi), math.cos(theta)))


pfm('sky.pfm', 64, 32, latlong)


def ply(name, points, normals_, faces):
    with open(os.path.join(here, '..', 'meshes', name), 'wb') as f:
        f.write(b'ply\nformat binary_little_endian 1.0\ncomment made by scenes/textures/make.py\nelement vertex %d\n' % len(points))
        f.write(b''.join(b'property float %s\n' % c for c in (b'x', b'y', b'z', b'nx', b'ny', b'nz')))
        f.write(b'element face %d\nproperty list uchar ushort vertex_indices\nend_header\n' % len(faces))
        for p, n in zip(points, normals_):
            f.write(struct.pack('<6f', *p, *n))
        for q in faces:
            f.write(struct.pack('<B%dH' % len(q), len(q), *q))


def tube(name, curve, along, around, radius):
    """Closed tube around a curve, as quads."""
    points, normals_ = [], []
    for i in range(along):
        t = 2 * math.pi * i / along
        p, q = curve(t), curve(t + 1e-4)
        d = [b - a for a, b in zip(p, q)]
        s = math.sqrt(sum(v * v for v in d))
        d = [v / s for v in d]
        up = (0.3, 0.9, 0.31)
        a = [up[1] * d[2] - up[2] * d[1], up[2] * d[0] - up[0] * d[2], up[0] * d[1] - up[1] * d[0]]
        s = math.sqrt(sum(v * v for v in a))
        a = [v / s for v in a]
        b = [d[1] * a[2] - d[2] * a[1], d[2] * a[0] - d[0] * a[2], d[0] * a[1] - d[1] * a[0]]
        for j in range(around):
            w = 2 * math.pi * j / around
            n = [math.cos(w) * u + math.sin(w) * v for u, v in zip(a, b)]
            points.append([u + radius * v for u, v in zip(p, n)])
            normals_.append(n)
    faces = [[i * around + j, i * around + (j + 1) % around, (i + 1) % along * around + (j + 1) % around, (i + 1) % along * around + j]
             for i in range(along) for j in range(around)]
    ply(name, points, normals_, faces)


tube('knot.ply', lambda t: ((0.62 + 0.26 * math.cos(3 * t)) * math.cos(2 * t), 0.3 * math.sin(3 * t), (0.62 + 0.26 * math.cos(3 * t)) * math.sin(2 * t)),
     96, 12, 0.13)


def revolve(name, profile, around):
    points, normals_, faces = [], [], []
    n = len(profile)
    for i, (r, y) in enumerate(profile):
        (r0, y0), (r1, y1) = profile[max(i - 1, 0)], profile[min(i + 1, n - 1)]
        dr, dy = r1 - r0, y1 - y0
        s = math.hypot(dr, dy)
        for j in range(around):
            w = 2 * math.pi * j / around
            points.append((r * math.cos(w), y, r * math.sin(w)))
            normals_.append((dy / s * math.cos(w), -dr / s, dy / s * math.sin(w)))
    for i in range(n - 1):
        for j in range(around):
            k = (j + 1) % around
            faces.append([i * around + j, (i + 1) * around + j, (i + 1) * around + k, i * around + k])
    ply(name, points, normals_, faces)


outer = [(0.0, 0.0), (0.3, 0.0)] + [(0.34 + 0.14 * math.sin(math.pi * t * 1.25 - 0.2), 0.02 + 0.98 * t) for t in [i / 16 for i in range(17)]]
inner = [(r - 0.03, max(y, 0.05)) for r, y in reversed(outer[2:])] + [(0.0, 0.05)]
revolve('vase.ply', outer + inner, 32)
