"""Compares `ggn` with PyTorch on the same networks.

Prints interleaved timings of denoiser, generator, discriminator, one decision and training, as ratios ours / PyTorch. Skips with a
message when Debian's python3-torch is not installed."""
import json
import os
import re
import statistics
import sys

from lablib import tool

# What the libraries of both sides look at when they are loaded.
HELD = {"avx2": {"LULL_ISA": "avx2", "ATEN_CPU_CAPABILITY": "avx2", "ONEDNN_MAX_CPU_ISA": "AVX2", "OPENBLAS_CORETYPE": "Haswell"}}


def options(parser):
    parser.add_argument("--check", action="store_true", help="instead, golden values and one published training iteration in double "
                        "precision against PyTorch, for several seeds")
    parser.add_argument("--json", action="store_true", help='{"isa": [ours, PyTorch\'s], "times": [[name, ours in ms, PyTorch in ms or null]]}')
    parser.add_argument("--isa", choices=list(HELD), help="hold both sides to it, whatever the processor has")
    parser.add_argument("--model", type=tool.path, help="networks of the widths in the card beside this model, not the published ones")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--threads", type=int, default=2)


def flatten(j, path=""):
    if isinstance(j, dict):
        for k, v in j.items():
            yield from flatten(v, f"{path}.{k}" if path else k)
    elif isinstance(j, list):
        for k, v in enumerate(j):
            yield from flatten(v, f"{path}[{k}]")
    else:
        yield path, j


def check(networks):
    worst = {}
    for seeds in ((100, 300, 500), (1, 2, 3)):
        want = dict(flatten(networks.golden(*seeds)))
        for flag, tolerance in ((None, 1e-6), ("--float", None)):
            words = [f"--base-{n}={s}" for n, s in zip("rmd", seeds)] + ([flag] if flag else [])
            got = dict(flatten(json.loads(tool.bench("ggn_golden", "--train-step", *words))))
            for key, v in want.items():
                error = abs(got[key] - v) / max(abs(v), 1e-3)
                kind = flag or "double"
                if tolerance and error > tolerance:
                    print(f"{kind} seeds {seeds}: {key} = {got[key]}, PyTorch {v} (relative {error:.2g})")
                worst[kind] = max(worst.get(kind, 0), error)
    for kind, error in worst.items():
        print(f"{kind}: largest relative difference to PyTorch {error:.3g}")
    return 0 if worst["double"] <= 1e-6 else 1


def bench(networks, o):
    widths = [(), (), ()]
    if o.model:
        card = tool.load(o.model + ".card.json")
        widths = [(card[k],) for k in ("k_r", "k_m", "k_d")]
    networks.times(o.threads, widths)
    ours, theirs = [], []
    for _ in range(o.rounds):
        theirs.append(networks.times(o.threads, widths))
        ours.append(json.loads(tool.bench("ggn_networks", "--json", f"--threads={o.threads}", "--rounds=3", *(["--model=" + o.model] if o.model else []))))
    isa = [ours[0]["isa"], re.search(r"CPU capability usage: (\S+)", networks.torch.__config__.show())[1].lower()]
    if o.json:
        times = [[key, *(statistics.median(t[key] for t in ts) for ts in (ours, theirs))] for key in theirs[0]]
        alone = [[key, statistics.median(t[key] for t in ours), None] for key in ("blocks_16_ms", "blocks_16_alone_ms")]
        print(json.dumps({"isa": isa, "times": times + alone}))
        return 0
    print(f"instruction sets: ggn {isa[0]}, PyTorch {isa[1]}")
    print(f"{'':26}{'ggn ms':>10}{'PyTorch ms':>12}{'ratio':>8}")
    for key in theirs[0]:
        a, b = (statistics.median(t[key] for t in ts) for ts in (ours, theirs))
        print(f"{key:26}{a:10.2f}{b:12.2f}{a / b:8.2f}")
    return 0


def main(o):
    held = HELD.get(o.isa, {})
    if any(os.environ.get(name) != value for name, value in held.items()):
        os.execve(sys.executable, [sys.executable, *sys.argv], {**os.environ, **held})
    try:
        from lablib import torch_networks
    except ImportError as e:
        print(f"lab networks: PyTorch is not installed ({e}); nothing compared")
        return 0
    return check(torch_networks) if o.check else bench(torch_networks, o)
