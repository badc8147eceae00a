"""The published networks in PyTorch, their golden values and times."""
import math
import time

import numpy as np
import torch
import torch.nn.functional as F
from torch import nn


def lrelu():
    return nn.LeakyReLU(0.2)


class Pad(nn.Module):
    def forward(self, x):
        return F.pad(x, (1, 0, 1, 0))


def up(odd=False):
    return [nn.Upsample(scale_factor=2, mode="bilinear", align_corners=False)] + ([Pad()] if odd else [])


def conv(i, o):
    return nn.Conv2d(i, o, 3, padding=1)


def convt(i, o):
    return nn.ConvTranspose2d(i, o, 3, stride=1, padding=1)


def enc(i, o):
    return nn.Sequential(nn.MaxPool2d(2), conv(i, o), lrelu(), nn.BatchNorm2d(o), conv(o, o), lrelu())


class R(nn.Module):
    def __init__(self, k=16):
        super().__init__()
        self.e = nn.ModuleList([nn.Sequential(conv(3, k), lrelu(), conv(k, k), lrelu()), enc(k, 2 * k), enc(2 * k, 4 * k),
                                enc(4 * k, 8 * k),
                                nn.Sequential(nn.MaxPool2d(2), conv(8 * k, 16 * k), lrelu(), nn.BatchNorm2d(16 * k),
                                              conv(16 * k, 8 * k), lrelu(), *up(True))])
        dec = lambda i: nn.Sequential(convt(i, i // 2), lrelu(), nn.BatchNorm2d(i // 2), convt(i // 2, i // 4), lrelu(), *up())
        self.d = nn.ModuleList([dec(16 * k), dec(8 * k), dec(4 * k),
                                nn.Sequential(convt(2 * k, k), lrelu(), convt(k, k), lrelu(), nn.Conv2d(k, 3, 1), nn.Sigmoid())])

    def forward(self, x):
        skips = []
        for e in self.e:
            x = e(x)
            skips.append(x)
        for i, d in enumerate(self.d):
            x = d(torch.cat((x, skips[3 - i]), 1))
        return x


class M(nn.Module):
    def __init__(self, k=20):
        super().__init__()
        dec = lambda i, o: [nn.BatchNorm2d(i), convt(i, o), lrelu(), *up()]
        self.s = nn.Sequential(conv(18, k), lrelu(), conv(k, k), lrelu(), enc(k, 2 * k), enc(2 * k, 4 * k), enc(4 * k, 8 * k),
                               nn.MaxPool2d(2), conv(8 * k, 16 * k), lrelu(), nn.BatchNorm2d(16 * k),
                               convt(16 * k, 8 * k), lrelu(), nn.BatchNorm2d(8 * k), convt(8 * k, 4 * k), lrelu(), *up(True),
                               *dec(4 * k, 2 * k), *dec(2 * k, k), *dec(k, k), nn.Conv2d(k, 1, 1), nn.Sigmoid())

    def forward(self, x):
        return self.s(x)


class D(nn.Module):
    def __init__(self, k=64, dropout=True):
        super().__init__()
        stage = lambda i, o: [nn.Conv2d(i, o, 3, stride=3, padding=2), nn.BatchNorm2d(o), lrelu(), nn.MaxPool2d(3, 2, 1)]
        drop = lambda: [nn.Dropout(0.5)] if dropout else []
        fc = lambda i, o: [nn.Linear(i, o), nn.BatchNorm1d(o), lrelu(), *drop()]
        self.s = nn.Sequential(*stage(2, k), *stage(k, 2 * k), *stage(2 * k, 4 * k), nn.Flatten(), *fc(16 * k, 4 * k),
                               *fc(4 * k, 2 * k), *fc(2 * k, k), nn.Linear(k, 1), lrelu(), *drop())

    def forward(self, x):
        return self.s(x)


def unit(k, s):
    m = np.uint64(0xFFFFFFFF)
    h = (k.astype(np.uint64) + np.uint64((s * 0x9E3779B9) & 0xFFFFFFFF)) & m
    h ^= h >> np.uint64(16)
    h = (h * np.uint64(0x7FEB352D)) & m
    h ^= h >> np.uint64(15)
    h = (h * np.uint64(0x846CA68B)) & m
    h ^= h >> np.uint64(16)
    return h.astype(np.float64) / 2**32


def hash_weights(net, base):
    i = 0
    for mod in net.modules():
        if not isinstance(mod, (nn.Conv2d, nn.ConvTranspose2d, nn.Linear, nn.BatchNorm2d, nn.BatchNorm1d)):
            continue
        for kind in ("weight", "bias"):
            p = getattr(mod, kind)
            u = 2 * unit(np.arange(p.numel()), base + i) - 1
            if isinstance(mod, (nn.BatchNorm2d, nn.BatchNorm1d)):
                v = 0.1 * u + (1 if kind == "weight" else 0)
            elif kind == "bias":
                v = 0.1 * u
            else:
                fan = mod.in_features if isinstance(mod, nn.Linear) else mod.in_channels * mod.kernel_size[0] ** 2
                v = u * math.sqrt(6 / fan)
            p.data = torch.tensor(v.reshape(p.shape), dtype=torch.float64)
            i += 1


def image(w, i):
    y, x = np.mgrid[0:200, 0:200]
    planes = []
    for c in range(3):
        v = 0.5 + 0.4 * np.sin((0.02 + 0.01 * w) * x + (0.03 + 0.02 * w) * y + c + w)
        if i >= 0:
            v = v + 0.3 / ((1 + w) * (i + 1)) * (2 * unit(c * 40000 + 200 * y + x, 1000 * (w + 1) + i) - 1)
        planes.append(np.clip(v, 0, 1))
    return np.stack(planes)


def ssim(a, b):
    g = torch.tensor([math.exp(-((k - 5) ** 2) / 4.5) for k in range(11)], dtype=torch.float32)
    g = (g / g.sum())[:, None]
    w = g.mm(g.t()).to(a.dtype).expand(3, 1, 11, 11).contiguous()
    blur = lambda t: F.conv2d(t, w, padding=5, groups=3)
    m1, m2 = blur(a), blur(b)
    s1, s2, s12 = blur(a * a) - m1 * m1, blur(b * b) - m2 * m2, blur(a * b) - m1 * m2
    return ((2 * m1 * m2 + 1e-4) * (2 * s12 + 9e-4) / ((m1 * m1 + m2 * m2 + 1e-4) * (s1 + s2 + 9e-4))).mean()


def l2(params):
    return math.sqrt(sum(float((p.grad**2).sum()) for p in params if p.grad is not None))


def golden(br, bm, bd):
    r, m, d = R().double(), M().double(), D(dropout=False).double()
    for net, base in ((r, br), (m, bm), (d, bd)):
        hash_weights(net, base)
    x = torch.tensor(np.stack([np.concatenate([image(w, i) for i in range(6)]) for w in range(4)]))
    ref = torch.tensor(np.stack([image(w, -1) for w in range(4)]))
    out = {}
    with torch.no_grad():
        for net in (r, m, d):
            net.eval()
        den = torch.cat([r(x[:, 3 * k:3 * k + 3]) for k in range(6)], 1)
        a, b = m(den), m(x)
        out["logit"] = d(torch.cat((a, b), 1)).flatten().tolist()
        out["denoiser_mean"] = float(den[0].mean())
        out["generator_noisy_std"] = float(b[0].std(unbiased=False))
        out["generator_denoised_std"] = float(a[0].std(unbiased=False))
        out["ssim"] = {"denoised0": float(ssim(den[:1, :3], ref[:1]))}
    for net in (r, m, d):
        net.train()
    adam = lambda p: torch.optim.Adam(p, lr=2e-4, betas=(0.5, 0.999))
    m_trained = list(m.parameters())[:-2]
    opt_r, opt_m, opt_d = adam(r.parameters()), adam(m_trained), adam(d.parameters())
    kept, out["denoiser_loss"] = [], []
    for k in range(6):
        opt_r.zero_grad()
        p = r(x[:, 3 * k:3 * k + 3])
        loss = 1 - ssim(p, ref)
        loss.backward()
        if k == 0:
            out["denoiser_grad_l2"] = l2(r.parameters())
        opt_r.step()
        kept.append(p.detach())
        out["denoiser_loss"].append(float(loss))
    nfm = torch.cat((m(torch.cat(kept, 1)), m(x)), 1)
    y = torch.tensor([[1.0], [0.0], [1.0], [0.0]], dtype=torch.float64)
    bce = nn.BCEWithLogitsLoss()
    z = d(nfm)
    loss = bce(z, y)
    loss.backward(retain_graph=True)
    out["d_prob_before"], out["bce_before"] = torch.sigmoid(z).flatten().tolist(), float(loss)
    out["d_grad_l2"] = l2(d.parameters())
    opt_d.step()
    z = d(nfm)
    loss = bce(z, y)
    loss.backward()
    out["d_prob_after"], out["bce_after"] = torch.sigmoid(z).flatten().tolist(), float(loss)
    out["m_grad_l2_accumulated"] = l2(m_trained)
    opt_m.step()
    bn = (nn.BatchNorm2d, nn.BatchNorm1d)
    for key, f in (("sum_params", lambda n: sum(float(p.sum()) for p in n.parameters())),
                   ("sum_running_mean", lambda n: sum(float(q.running_mean.sum()) for q in n.modules() if isinstance(q, bn))),
                   ("sum_running_var", lambda n: sum(float(q.running_var.sum()) for q in n.modules() if isinstance(q, bn)))):
        out[key] = {c: f(n) for c, n in (("r", r), ("m", m), ("d", d))}
    return out


def times(threads, widths):
    torch.set_num_threads(threads)
    torch.manual_seed(1)
    r, m, d = (net(*k) for net, k in zip((R, M, D), widths))
    x3, x18, x2 = torch.rand(1, 3, 200, 200), torch.rand(1, 18, 200, 200), torch.rand(1, 2, 200, 200)
    b3, b18 = torch.rand(4, 3, 200, 200), torch.rand(4, 18, 200, 200)
    ref = torch.rand(4, 3, 200, 200)

    def timed(f):
        t = time.perf_counter()
        f()
        return 1e3 * (time.perf_counter() - t)

    def train_r():
        loss = 1 - ssim(r(b3), ref)
        loss.backward()

    def train_m():
        m(b18).sum().backward()

    for net in (r, m, d):
        net.eval()
    out = {}
    with torch.no_grad():
        out["denoiser_forward_ms"] = timed(lambda: r(x3))
        out["generator_forward_ms"] = timed(lambda: m(x18))
        out["discriminator_forward_ms"] = timed(lambda: d(x2))
        out["decision_ms"] = timed(lambda: (r(x3), d(torch.cat((m(x18), m(x18)), 1))))
    for net in (r, m, d):
        net.train()
    out["denoiser_train_ms"] = timed(train_r) / 4
    out["generator_train_ms"] = timed(train_m) / 4
    out["train_sample_ms"] = 6 * out["denoiser_train_ms"] + 2 * out["generator_train_ms"] + 3 * out["discriminator_forward_ms"]
    return out
