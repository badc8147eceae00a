#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Hosts a stopping criterion from plain Python: nothing but ctypes, no numpy, no build step.

    scripts/hosts/ctypes_host.py build/lib/lull/halfbuf.so [KEY=VALUE ...]

The upper half is all that a renderer with a Python API needs: the structs of lull/criterion.h and the class Criterion.
The lower half is a demonstration: a made-up progressive render of four blocks, stored as a renderer like Blender would
(RGBA, rows bottom-up), sampled until the criterion stops every block.
"""
import ctypes as C
import math
import random
import sys
from array import array

U32, I32, U64, I64, F64, P, S = C.c_uint32, C.c_int32, C.c_uint64, C.c_int64, C.c_double, C.c_void_p, C.c_char_p


def struct(name, *fields):
    return type(name, (C.Structure,), {"_fields_": [(f, t) for t, names in fields for f in names.split()]})


Error = struct("Error", (U32, "struct_size"), (I32, "code"), (C.c_char * 504, "message"))
Pair = struct("Pair", (S, "key value"))
Rect = struct("Rect", (I32, "x0 y0 x1 y1"))
Requirements = struct("Requirements", (U32, "struct_size flags planes_required planes_used block_width block_height halo"),
                      (U32, "checks_hint"), (U64, "first_spp bytes_per_block"))
Frame = struct("Frame", (U32, "struct_size flags width height"), (P, "blocks"), (U32, "block_count block_stride planes"),
               (I32, "transfer"), (F64, "gamma exposure sample_clamp time_budget_s"), (U64, "spp_min spp_max seed"),
               (F64 * 9, "rgb_to_xyz"))
Plane = struct("Plane", (P, "data"), (I64, "stride_x stride_y stride_c"), (F64, "scale"), (I32, "type normaliser"),
               (U32, "channels flags"))
Block = struct("Block", (U32, "id flags"), (I32, "x0 y0 x1 y1"), (U64, "spp half_spp"), (F64, "thread_s"))
View = struct("View", (U32, "struct_size flags"), (I32, "x0 y0 x1 y1"), (P, "planes"), (U32, "plane_count plane_stride"),
              (P, "all"), (U32, "all_count all_stride"), (F64, "elapsed_s"))
Decision = struct("Decision", (I32, "action"), (U32, "flags"), (U64, "next_spp"), (F64, "p_noisy predicted_spp error"))
Table = struct("Table", (U32, "struct_size api_minor"), (S, "id name version description"), (P, "params"),
               (U32, "param_count param_stride"), (I32, "thread_level"), (U32, "capabilities"),
               (C.CFUNCTYPE(I32, P, P, U32, U32, P, P), "create"), (C.CFUNCTYPE(I32, P, P, P), "requirements begin_frame"),
               (C.CFUNCTYPE(I32, P, P, P, U32, P, U32, U32, P), "evaluate"), (C.CFUNCTYPE(None, P), "end_frame destroy"),
               (C.CFUNCTYPE(P, S), "get_extension"))
COLOR, WEIGHT, SPP, MOMENT2, HALF, PLANES = 0, 1, 2, 3, 4, 8
NORM_ONE, NORM_SPP, NORM_HALF_SPP = 0, 1, 2
STOP = 1


def sized(struct_type, **fields):
    return struct_type(struct_size=C.sizeof(struct_type), **fields)


class Criterion:
    """One instance of the first criterion of a library. The host pointer is NULL: no log, no workers."""

    def __init__(self, path, pairs=()):
        entry = C.CDLL(path).lull_criterion_entry_v1
        entry.restype, entry.argtypes = C.POINTER(Table), [U32]
        self.table, self.instance, self.error = entry(0).contents, P(), sized(Error)
        text = (Pair * len(pairs))(*[Pair(k.encode(), v.encode()) for k, v in pairs])
        self._call(self.table.create, None, text, len(pairs), C.sizeof(Pair), C.byref(self.instance))
        self.requirements = sized(Requirements)
        self._call(self.table.requirements, self.instance, C.byref(self.requirements))

    def _call(self, function, *arguments):
        if function(*arguments, C.byref(self.error)) != 0:
            raise RuntimeError(self.error.message.decode())

    def begin_frame(self, width, height, rects, planes, spp_max=0, seed=0):
        blocks = (Rect * len(rects))(*[Rect(*r) for r in rects])
        frame = sized(Frame, width=width, height=height, blocks=C.addressof(blocks), block_count=len(rects),
                      block_stride=C.sizeof(Rect), planes=planes, exposure=1, gamma=2.2, spp_max=spp_max, seed=seed,
                      rgb_to_xyz=(F64 * 9)(.4124, .3576, .1805, .2126, .7152, .0722, .0193, .1192, .9505))
        self._call(self.table.begin_frame, self.instance, C.byref(frame))

    def evaluate(self, width, height, planes, all_blocks, due):
        """planes: {index: Plane}; all_blocks: [Block] by id; due: ids to ask about. Returns a Decision per due id."""
        table = (Plane * PLANES)(*[planes.get(i, Plane()) for i in range(PLANES)])
        everything = (Block * len(all_blocks))(*all_blocks)
        blocks = (Block * len(due))(*[all_blocks[i] for i in due])
        decisions = (Decision * len(due))(*[Decision(0, 0, 0, math.nan, math.nan, math.nan) for _ in due])
        view = sized(View, x1=width, y1=height, planes=C.addressof(table), plane_count=PLANES, plane_stride=C.sizeof(Plane),
                     all=C.addressof(everything), all_count=len(everything), all_stride=C.sizeof(Block), elapsed_s=math.nan)
        self._call(self.table.evaluate, self.instance, C.byref(view), blocks, C.sizeof(Block), decisions,
                   C.sizeof(Decision), len(due))
        return list(decisions)

    def close(self):
        self.table.end_frame(self.instance)
        self.table.destroy(self.instance)


# --- demonstration -----------------------------------------------------------------------------------------------------

LUMINANCE = (.2126, .7152, .0722)
SPP_MAX = 1024


class Render:
    """Sums of made-up samples, in rows from the bottom up. Noise by block: none, a little, much, rare bright ones."""

    def __init__(self, width, height):
        self.width, self.height = width, height
        self.color, self.half = array("f", bytes(16 * width * height)), array("f", bytes(16 * width * height))
        self.moment2 = array("f", bytes(4 * width * height))

    def sample(self, block, spp):
        half = spp // 2 - block.half_spp
        for count, to_half in ((half, True), (spp - block.spp - half, False)):
            for y in range(block.y0, block.y1):
                for x in range(block.x0, block.x1):
                    self._add((self.height - 1 - y) * self.width + x, block.id % 4, count, to_half)
        block.spp, block.half_spp = spp, spp // 2

    def _add(self, pixel, kind, count, to_half):
        value, sigma = .4, (0, .1, .5, .1)[kind]
        total = count * value + math.sqrt(count) * value * sigma * random.gauss(0, 1)
        squares = count * value * value * (1 + sigma * sigma)
        if kind == 3 and random.random() < count * 1e-5:
            total, squares = total + 300, squares + 9e4
        for c in range(3):
            self.color[4 * pixel + c] += total
            if to_half:
                self.half[4 * pixel + c] += total
        self.moment2[pixel] += squares * sum(LUMINANCE) ** 2

    def planes(self):
        def plane(memory, channels, normaliser):
            size = 4 * (4 if channels == 3 else 1)
            row, (start, _) = size * self.width, memory.buffer_info()
            return Plane(start + row * (self.height - 1), size, -row, 4, 1, 0, normaliser, channels, 0)
        return {COLOR: plane(self.color, 3, NORM_SPP), HALF: plane(self.half, 3, NORM_HALF_SPP),
                MOMENT2: plane(self.moment2, 1, NORM_SPP)}


def demonstrate(path, pairs):
    random.seed(1)
    criterion = Criterion(path, pairs)
    need = criterion.requirements
    w, h = need.block_width or 32, need.block_height or 32
    width, height = 2 * w, 2 * h
    blocks = [Block(i, 0, i % 2 * w, i // 2 * h, (i % 2 + 1) * w, (i // 2 + 1) * h, 0, 0, math.nan) for i in range(4)]
    render = Render(width, height)
    supplied = 1 << COLOR | 1 << HALF | 1 << MOMENT2
    criterion.begin_frame(width, height, [(b.x0, b.y0, b.x1, b.y1) for b in blocks], supplied, SPP_MAX, 1)
    table = criterion.table
    print(f"{table.id.decode()} {table.version.decode()}: {table.name.decode()}")
    target, state = [need.first_spp] * 4, ["limit"] * 4
    active = [0, 1, 2, 3]
    while active:
        for i in active:
            render.sample(blocks[i], min(target[i], SPP_MAX))
        for i, d in zip(active[:], criterion.evaluate(width, height, render.planes(), blocks, active)):
            print(f"  block {i} at {blocks[i].spp:4} spp: {'stop' if d.action == STOP else 'continue':8} error {d.error:.4g}")
            target[i] = d.next_spp or 2 * blocks[i].spp
            if d.action == STOP:
                state[i] = "stopped"
            if d.action == STOP or blocks[i].spp >= SPP_MAX:
                active.remove(i)
    criterion.close()
    for row in range(2):
        print("   ".join(f"{blocks[2 * row + k].spp:5} spp {state[2 * row + k]}" for k in range(2)))


if __name__ == "__main__":
    if len(sys.argv) < 2 or sys.argv[1] in ("-h", "--help") or any("=" not in a for a in sys.argv[2:]):
        sys.exit(__doc__)
    try:
        demonstrate(sys.argv[1], [a.split("=", 1) for a in sys.argv[2:]])
    except (OSError, RuntimeError, AttributeError) as error:
        sys.exit(f"ctypes_host: {error}")
