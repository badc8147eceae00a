"""Hosts for the tests: a renderer of made-up noise in numpy, and one that plays back what the path tracer recorded."""
import functools
import json
import subprocess
import tempfile
import zlib
from pathlib import Path

import numpy as np

import lull


class Noise:
    """Grey .4 with normal noise, its strength by block of `block` pixels; the same values whatever is asked for together."""

    def __init__(self, sigmas, block=16):
        self.sigmas, self.block, self.calls = np.asarray(sigmas), block, []

    def __call__(self, rects, first, count, half):
        self.calls.append((list(rects), first, count, half))
        for r in rects:
            yield np.mean([self.sample(r, s) for s in range(first, first + count)], 0)

    def sample(self, r, index):
        sigma = self.sigmas[r.y0 // self.block, r.x0 // self.block]
        return .4 * (1 + sigma * normal(*r, index))


@functools.cache
def normal(x0, y0, x1, y1, index):
    return np.random.default_rng((x0, y0, index)).normal(size=(y1 - y0, x1 - x0, 3))


def read_full_record(path):
    """spp, half_spp, mean and difference D [h, w, 3] of the one full level of a block-NNNNN.lseq (ggn/data/FORMAT.md)."""
    data = Path(path).read_bytes()
    width, height = np.frombuffer(data, "<u4", 2, 16)
    spp, half_spp, statistics, planes = np.frombuffer(data, "<u4", 4, 64 + 4)
    at, found = 64 + 32 + int(statistics) * 32, {}
    for _ in range(planes):
        kind, filters, _, stored = (int(v) for v in np.frombuffer(data, "<u4", 4, at))
        raw = zlib.decompress(data[at + 16:at + 16 + stored])
        if kind in (4, 5):
            if filters & 1:  # all low bytes, then all high bytes
                raw = np.frombuffer(raw, np.uint8).reshape(2, -1).T.tobytes()
            found[kind] = np.frombuffer(raw, "<f2").reshape(3, height, width).transpose(1, 2, 0).astype(float)
        at += 16 + stored
    return int(spp), int(half_spp), found[4], found[5]


class Playback(lull.Driver):
    """Shows the frame what the path tracer records of the same scene: one sequence per block and level asked for."""

    def __init__(self, frame, program, scene, options):
        super().__init__(frame, None)
        self.command = [program, scene, "-q", "--size", f"{frame.width}x{frame.height}", "--block",
                        f"{frame.layout.block_width}x{frame.layout.block_height}", "--seed", str(frame.seed), *options]

    def render_blocks(self, blocks, first, count):
        spp = first + count
        with tempfile.TemporaryDirectory() as folder:
            subprocess.run([*self.command, "--sequence", folder, "--levels", f"linear:{spp}:{spp}:1", "--blocks",
                            ",".join(str(b.id) for b in blocks)], check=True, stdout=subprocess.DEVNULL)
            files = {b["id"]: b["file"] for b in json.loads(Path(folder, "manifest.json").read_text())["blocks"]}
            for b in blocks:
                n, h, mean, difference = read_full_record(Path(folder, files[b.id]))
                assert n == spp
                # D = (A - B) / 2 and mean = (h A + (n - h) B) / n
                self.frame.put(b, mean, n, mean + 2 * difference * (n - h) / n, h)
                self.totals.samples += b.rect.pixels * count
