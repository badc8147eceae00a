"""A small network in PyTorch that sees the pixels of denoised windows: what it is shown, how it learns, what it says of scenes left out.

Windows are what tests/bench/pt_looks.c keeps of each number of samples. The network says by how many octaves the criterion `denoised` errs
about a block, log2(true / believed). Its last layer begins at zero: untrained it is the criterion."""
import math
import os
import random

import numpy as np
import torch
import torch.nn.functional as F
from torch import nn

POOL = 2          # pixels of a picture for one that the network sees, each way
FAINT = 1 / 16    # of L*: for logarithms of differences
WIDTHS, HEAD = (12, 16, 24), 16
EPOCHS, PATIENCE, BATCH, RATE, DECAY, HUBER = 40, 8, 32, 2e-3, 1e-2, 0.5
KEPT_BACK = 5     # of so many scenes trained on, one tells when to end


def luminance(rgb):
    """As a display shows it, 1 is its white."""
    return (rgb @ np.float32([0.2126, 0.7152, 0.0722])).clip(0, 1)


def slope(y):
    """Of L* by luminance (CIE 15:2004)."""
    knee = 216 / 24389
    return np.where(y > knee, 116 / 3 * np.maximum(y, knee) ** (-2 / 3), 24389 / 27).astype(np.float32)


def lightness(y):
    knee = 216 / 24389
    return np.where(y > knee, 116 * np.cbrt(np.maximum(y, knee)) - 16, 24389 / 27 * y).astype(np.float32)


def blurred(picture, sigma):
    radius = math.ceil(3 * sigma)
    line = torch.exp(-torch.arange(-radius, radius + 1, dtype=torch.float32) ** 2 / (2 * sigma ** 2))
    line = line / line.sum()
    t = torch.from_numpy(picture)[None, None]
    for shape, pad in (((1, 1, 1, -1), (radius, radius, 0, 0)), ((1, 1, -1, 1), (0, 0, radius, radius))):
        t = F.conv2d(F.pad(t, pad, mode="replicate"), line.reshape(shape))
    return t[0, 0].numpy()


def shown(path, before):
    """[channels, height, width] of a window; before: what was kept and how far the halves were apart at the look before it, or None."""
    raw = np.fromfile(path, np.float32)
    side = math.isqrt(raw.size // 19)
    n = side * side
    pictures, weight = raw[:18 * n].reshape(6, side, side, 3), raw[18 * n:].reshape(side, side)
    a, b, fa, fb, kept, blend = (luminance(np.nan_to_num(p)) for p in pictures)
    unit, apart = slope(kept), abs(lightness(fa) - lightness(fb)) / 2
    crossed = blurred(unit ** 2 * (((fa - b) ** 2 + (fb - a) ** 2 - (a - b) ** 2) / 2 - (fa - fb) ** 2 / 4), 3)
    off = lightness(kept) if before is None else before[0]
    differences = [apart, abs(lightness(a) - lightness(b)) / 2, abs(unit * (blurred(kept, 2) - blurred((a + b) / 2, 2))),
                   abs(lightness(kept) - off), apart if before is None else before[1]]
    pooled = lambda maps: F.avg_pool2d(torch.from_numpy(np.stack(maps)), POOL)
    return torch.cat([torch.log2(pooled([d ** 2 for d in differences]).sqrt() + FAINT),
                      pooled([np.sign(crossed) * abs(crossed) ** 0.5, lightness(blend) / 100, weight])]), (lightness(kept), apart)


def scene(folder, looks, numbers, octaves):
    """What the network is shown of each look of a scene and what it should say, NaN where nobody knows."""
    across = math.isqrt(1 + max(look["block"] for look in looks))
    whole, before = {}, None
    for spp in sorted({look["spp"] for look in looks}):
        whole[spp], before = shown(os.path.join(folder, "%d.windows" % spp), before)
    out = []
    for look in looks:
        side = whole[look["spp"]].shape[1] // across
        y, x = (k * side for k in divmod(look["block"], across))
        out.append(whole[look["spp"]][:, y:y + side, x:x + side])
    return {"pixels": torch.stack(out), "numbers": torch.tensor(numbers, dtype=torch.float32),
            "octaves": torch.tensor([math.nan if y is None else y for y in octaves], dtype=torch.float32)}


class Windows(nn.Module):
    """[n, channels, height, width] and [n, numbers] to octaves [n]; of the means and deviations that it was made with."""

    def __init__(self, pixels, numbers):
        super().__init__()
        self.of = {"pixels": (pixels.mean((0, 2, 3), keepdim=True), pixels.std((0, 2, 3), keepdim=True) + 1e-3),
                   "numbers": (numbers.mean(0), numbers.std(0) + 1e-3)}
        widths = (pixels.shape[1], *WIDTHS)
        self.convs = nn.ModuleList(nn.Conv2d(i, o, 3, stride=2, padding=1) for i, o in zip(widths, WIDTHS))
        self.mixed, self.out = nn.Linear(2 * WIDTHS[-1] + numbers.shape[1], HEAD), nn.Linear(HEAD, 1)
        nn.init.zeros_(self.out.weight)
        nn.init.zeros_(self.out.bias)

    def forward(self, pixels, numbers):
        x, y = ((value - self.of[key][0]) / self.of[key][1] for key, value in (("pixels", pixels), ("numbers", numbers)))
        for conv in self.convs:
            x = F.leaky_relu(conv(x), 0.1)
        return self.out(F.leaky_relu(self.mixed(torch.cat((x.mean((2, 3)), x.amax((2, 3)), y), 1)), 0.1))[:, 0]


def turned(pixels, draw):
    """One of the eight ways in which a square can lie."""
    for axis in (2, 3):
        if draw.random() < 0.5:
            pixels = pixels.flip(axis)
    return pixels.transpose(2, 3) if draw.random() < 0.5 else pixels


def said(net, data):
    with torch.no_grad():
        return torch.cat([net(*part) for part in zip(data["pixels"].split(256), data["numbers"].split(256))])


def answers(net, data):
    return said(net, data).tolist()


def joined(scenes, names):
    """The looks of these scenes whose truth is known."""
    known = {name: ~scenes[name]["octaves"].isnan() for name in names}
    return {key: torch.cat([scenes[name][key][known[name]] for name in names]) for key in ("pixels", "numbers", "octaves")}


def trained(scenes, names, seed):
    """A network that knows these scenes; those of them that are kept back tell after which epoch, none at all if none did any good."""
    torch.manual_seed(seed)
    draw = random.Random(seed)
    names = draw.sample(sorted(names), len(names))
    back = max(1, len(names) // KEPT_BACK)
    learnt, held = joined(scenes, names[back:]), joined(scenes, names[:back])
    net = Windows(learnt["pixels"], learnt["numbers"])
    optimizer = torch.optim.AdamW(net.parameters(), lr=RATE, weight_decay=DECAY)
    loss = nn.HuberLoss(delta=HUBER)
    best, kept, since = float(loss(said(net, held), held["octaves"])), {k: v.clone() for k, v in net.state_dict().items()}, 0
    for _ in range(EPOCHS):
        for some in torch.randperm(len(learnt["octaves"])).split(BATCH):
            optimizer.zero_grad()
            loss(net(turned(learnt["pixels"][some], draw), learnt["numbers"][some]), learnt["octaves"][some]).backward()
            optimizer.step()
        now, since = float(loss(said(net, held), held["octaves"])), since + 1
        if now < best:
            best, kept, since = now, {k: v.clone() for k, v in net.state_dict().items()}, 0
        if since == PATIENCE:
            break
    net.load_state_dict(kept)
    return net


def size():
    """Parameters."""
    return sum(p.numel() for p in Windows(torch.zeros(2, 8, 8, 8), torch.zeros(2, 5)).parameters())
