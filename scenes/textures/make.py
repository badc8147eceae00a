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

# --- more textures: drawn after the others, whose random numbers stay what they are ---


def marble(x, y):
    vein = abs(math.sin(math.pi * (4 * x / 128 + 3 * noise(x / 128, y / 128)))) ** 0.35
    return (0.55 + 0.38 * vein, 0.54 + 0.38 * vein, 0.52 + 0.38 * vein)


def concrete(x, y):
    tone = 0.42 + 0.2 * noise(x / 128, y / 128) + 0.06 * (random.random() - 0.5)
    return (tone, tone, 0.97 * tone) if x % 64 and y % 64 else (0.7 * tone,) * 3


def wallpaper(x, y):
    u, v = (x + 16 * (y // 32 % 2)) % 32 - 15.5, y % 32 - 15.5
    r, a = math.hypot(u, v), math.atan2(v, u)
    petal = r < 6 + 4 * math.cos(5 * a)
    return (0.72, 0.55, 0.3) if r < 2.5 else (0.62, 0.68, 0.6) if petal else (0.8, 0.79, 0.7)


def rug(x, y):
    u, v = abs(x - 63.5), abs(y - 63.5)
    ring = int(max(u, v) / 9) if max(u, v) > 27 else 7 + int((u + v) / 9)
    tone = 0.85 + 0.3 * random.random()
    return tuple(tone * c for c in ((0.5, 0.1, 0.09), (0.65, 0.52, 0.3), (0.1, 0.14, 0.3), (0.55, 0.24, 0.1))[ring % 4])


def grass(x, y):
    tone = 0.5 + 0.6 * noise(x / 128, y / 128) + 0.35 * (random.random() - 0.5)
    return (0.22 * tone, 0.36 * tone, 0.11 * tone)


def paving(x, y):
    row = y // 32
    u, v = (x + 32 * (row % 2)) % 128, y % 32
    key = ('s', row, u // 64)
    tone = shade.setdefault(key, random.uniform(0.8, 1.05)) * (0.75 + 0.4 * noise(x / 128, y / 128))
    return (0.3, 0.28, 0.25) if min(u % 64, v) < 1 else (0.62 * tone, 0.58 * tone, 0.5 * tone)


def picture(x, y):
    """A landscape to hang on a wall."""
    u, v = x / 128, y / 128
    hill = 0.62 + 0.12 * math.sin(5 * u + 1) + 0.05 * math.sin(17 * u)
    if math.hypot(u - 0.7, v - 0.3) < 0.08:
        return (0.95, 0.8, 0.45)
    if v < hill:
        return (0.75 - 0.3 * v, 0.55 + 0.1 * noise(u, v), 0.45 + 0.35 * v)
    return (0.2 + 0.15 * noise(u, v), 0.3 - 0.2 * (v - hill), 0.15)


for name, pixel in (('marble', marble), ('concrete', concrete), ('wallpaper', wallpaper), ('rug', rug), ('grass', grass),
                    ('paving', paving), ('picture', picture)):
    png(name + '.png', 128, 128, 3, pixel)


def evening(x, y, w=64, h=32):
    """A low red sun behind haze, z up."""
    phi, theta = 2 * math.pi * (x + 0.5) / w, math.pi * (y + 0.5) / h
    d = (math.sin(theta) * math.cos(phi), math.sin(theta) * math.sin(phi), math.cos(theta))
    if d[2] < 0:
        return (0.04, 0.035, 0.04)
    c = sum(p * q for p, q in zip(d, (0.3, 0.94, 0.16)))
    t = d[2] ** 0.4
    base = (0.75 - 0.6 * t, 0.42 - 0.25 * t, 0.38 - 0.08 * t)
    return tuple(b + g * (math.exp((c - 1) * 25) * 1.5 + (60 if c > 0.99 else 0)) for b, g in zip(base, (1, 0.55, 0.25)))


pfm('evening.pfm', 64, 32, evening)

# --- more meshes ---


def sheet(name, n, m, point):
    """A grid of quads over [0, 1]² with normals by differences."""
    points, normals_, faces = [], [], []
    for i in range(n + 1):
        for j in range(m + 1):
            p, q, r = point(i / n, j / m), point(i / n + 1e-4, j / m), point(i / n, j / m + 1e-4)
            a, b = [s - t for s, t in zip(q, p)], [s - t for s, t in zip(r, p)]
            c = (b[1] * a[2] - b[2] * a[1], b[2] * a[0] - b[0] * a[2], b[0] * a[1] - b[1] * a[0])
            s = math.sqrt(sum(v * v for v in c)) or 1
            points.append(p)
            normals_.append([v / s for v in c])
    for i in range(n):
        for j in range(m):
            k = i * (m + 1) + j
            faces.append([k, k + 1, k + m + 2, k + m + 1])
    ply(name, points, normals_, faces)


# Hills of 40 x 40 units around the origin, flat in the middle.
def hills(u, v):
    x, z = 40 * u - 20, 40 * v - 20
    far = min(max((math.hypot(x, z) - 4) / 14, 0), 1)
    return (x, far * far * (1.2 + 5 * (noise(u % 1 * 0.999, v % 1 * 0.999) - 0.5)), z)


sheet('hills.ply', 40, 40, hills)
# A curtain 1 wide, 1 high.
sheet('curtain.ply', 64, 4, lambda u, v: (u - 0.5, v, (0.05 + 0.02 * (1 - v)) * math.sin(14 * math.pi * u + 2 * math.sin(7 * u))))


def stone(u, v):
    a, b = 2 * math.pi * u, math.pi * v
    d = (math.sin(b) * math.cos(a), math.cos(b), math.sin(b) * math.sin(a))
    r = 0.5 + 0.09 * math.sin(3 * d[0] + 2 * d[1]) * math.cos(4 * d[2] + 1) + 0.05 * math.sin(7 * d[1] + 5 * d[0]) + 0.03 * math.cos(11 * d[2] - 6 * d[0])
    return tuple(r * c for c in d)


sheet('stone.ply', 32, 20, stone)
# Turned pieces: a cup (open), a bottle, a chess pawn, a fir as stacked cones.
revolve('cup.ply', [(0.0, 0.0), (0.25, 0.0), (0.27, 0.03), (0.34, 0.25), (0.38, 0.6), (0.36, 0.6), (0.32, 0.25), (0.24, 0.05), (0.0, 0.05)], 32)
revolve('bottle.ply', [(0.0, 0.0), (0.2, 0.0), (0.22, 0.02)] + [(0.22, 0.02 + 0.06 * i) for i in range(1, 10)]
        + [(0.22 - 0.14 * math.sin(math.pi / 2 * i / 5) ** 2, 0.56 + 0.04 * i) for i in range(1, 6)] + [(0.08, 0.95), (0.1, 0.96), (0.1, 1.0), (0.0, 1.0)], 32)
revolve('pawn.ply', [(0.0, 0.0), (0.3, 0.0), (0.31, 0.06), (0.26, 0.12), (0.16, 0.22), (0.11, 0.4), (0.1, 0.5), (0.17, 0.53), (0.17, 0.56), (0.1, 0.58)]
        + [(0.17 * math.sin(math.pi * t / 8), 0.73 - 0.17 * math.cos(math.pi * t / 8)) for t in range(2, 9)], 28)
revolve('fir.ply', [(0.0, 0.0), (0.05, 0.0), (0.05, 0.2), (0.42, 0.2), (0.2, 0.5), (0.33, 0.48), (0.15, 0.76), (0.23, 0.74), (0.0, 1.1)], 14)


# Textures of the test scenes foreign-*; no other scene has them.
LETTERS = ['01110100011000111111100011000110001', '11110100011111010001100011000111110', '01111100001000010000100001000001111', '11111100001111010000100001000011111',
           '10001100011111110001100011000110001', '01110001000010000100001000010001110', '10001110011010110011100011000110001', '01110100011000110001100011000101110',
           '11110100011000111110100001000010000', '01111100000111000001000010000111110', '11111001000010000100001000010000100', '10001100011000110001010100101000100']


def printed(x, y):
    line, row, column, place = y // 10, y % 10 - 1, x % 6, x // 6
    glyph = random.Random(line * 97 + place).randrange(15)  # beyond the letters: a blank
    inked = glyph < len(LETTERS) and 0 <= row < 7 and column < 5 and LETTERS[glyph][5 * row + column] == '1' and 6 < x < 118
    tone = 0.9 + 0.04 * noise(x / 128, y / 128)
    return (0.09, 0.08, 0.1) if inked else (tone, 0.97 * tone, 0.88 * tone)


def twill(x, y):
    over = (x // 4 + y // 4) % 4 < 2
    across = (y if over else x) % 4
    tone = (0.55, 1.0, 0.95, 0.5)[across] * (0.85 + 0.3 * noise(x / 64, y / 64))
    return (0.22 * tone, 0.27 * tone, 0.42 * tone) if over else (0.62 * tone, 0.58 * tone, 0.5 * tone)


def brushed(x, y):
    return (0.06 + 0.3 * (0.7 * noise(x / 512 % 1, y * 7 / 128 % 1) + 0.3 * random.Random(y).random()),)


def mosaic(x, y):
    piece = random.Random(x // 8 * 17 + y // 8)
    hue, tone, dx, dy = piece.randrange(4), piece.uniform(0.6, 1.1), piece.random() < 0.3, piece.random() < 0.3
    if x % 8 <= dx or y % 8 <= dy:
        return (0.5, 0.49, 0.46)
    return tuple(tone * c for c in ((0.1, 0.24, 0.5), (0.75, 0.72, 0.62), (0.6, 0.36, 0.1), (0.12, 0.4, 0.35))[hue])


for name, channels, pixel in (('printed', 3, printed), ('twill', 3, twill), ('brushed', 1, brushed), ('mosaic', 3, mosaic)):
    png(name + '.png', 128, 128, channels, pixel)
