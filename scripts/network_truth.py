"""What a network adds to the observer's law, held against references: network_truth.py record|train|judge WORK.

record: 48 scenes, 200x200, seeds 1 and 2 to 512 samples, two references of 640; the noise of seed 1 also on a procedural texture.
train: networks that correct the law's answer, by PyTorch: five folds by scene and one for the test scenes, five seeds of each. judge
[GROUP...]: wrong stops at equal samples, and samples at equal wrong stops, of the law, of linear fits with each scene left out, and of
the networks. Flags of the scene's effects are those of lull-render --explain. FLAGS=0 trains without them."""
import json, os, shutil, struct, subprocess, sys, time, glob
import numpy as np
HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, HERE)
from lablib import law, tool
ROOT = tool.ROOT
LEVEL = tool.observer_law()
SEEDS, REFS = (1, 2), (101, 102)
QUICK = os.environ.get("QUICK")
SPP, REF = (64, 64) if QUICK else (512, 640)
CORES = int(os.environ.get("CORES", os.cpu_count()))
SHARED = os.path.join(os.path.dirname(ROOT), "shared", "scenes")
TEST = "rock-garden pergola harbour defocus alpha killeroos-v4/killeroo-simple caustic-glass-v4/caustic-glass-v4 museum".split()
POOL = ("chess judge/rare-lamps soft-shadow judge/foreign-cloth glossy cornell-box judge/rare-beads snow-hut plaza judge/foreign-print gems brick-yard "
        "judge/rare-foil crockery caustic-ring judge/foreign-metal night-street coated judge/rare-lens street delta-lights judge/foreign-checker glossy-row "
        "judge/rare-glint candles sky-image glass judge/rare-slit bathroom indirect-hall judge/foreign-leaves corridor bright-sky judge/rare-bulb mirror "
        "environment attic bump indirect office").split()


def order():
    pool, test = list(POOL), list(TEST)
    out = []
    while pool or test:
        out += pool[:5]
        pool = pool[5:]
        out += test[:1]
        test = test[1:]
    return out[:2] if QUICK else out


def name_of(scene):
    return os.path.basename(scene)


KIND = os.environ.get("KIND", "net")
EFFECTS = ("texture bump specular glossy transmission coated environment delta-light many-lights absorption scattering defocus motion "
           "instances").split()
MAPS = int(os.environ.get("MAPS", "1"))  # 0: the figures alone, by the last three layers
BATCH = int(os.environ.get("BATCH", "16"))
FLAGS = os.environ.get("FLAGS", "1") == "1"


def file_of(scene):
    file = os.path.join(SHARED, scene + ".pbrt")
    return file if os.path.exists(file) else os.path.join(ROOT, "scenes", scene + ".pbrt")


def effects(scene):
    """[14]: what a host could tell of the scene."""
    text = subprocess.run([tool.RENDER, "--explain", file_of(scene)], capture_output=True, text=True).stdout
    on = {line.split()[0] for line in text.splitlines() if " on " in line[:20]}
    return np.array([e in on for e in EFFECTS], np.float32)


def textured(kind, rng):
    """L* [200, 200] of a clean texture: dead leaves, tiles, text, cloth or brushed metal."""
    y, x = np.mgrid[0:200, 0:200].astype(float)
    if kind == 0:
        out = np.full((200, 200), 50.0)
        for r in np.sort(40 * rng.random(700) ** 3 + 2)[::-1]:
            cx, cy = rng.random(2) * 200
            out[(x - cx) ** 2 + (y - cy) ** 2 < r * r] = 15 + 70 * rng.random()
    elif kind == 1:
        side = rng.integers(10, 40)
        tone = 30 + 50 * rng.random((30, 30))
        out = tone[(y // side).astype(int), (x // side).astype(int)]
        out[(x % side < 2) | (y % side < 2)] = 20
    elif kind == 2:
        line = rng.integers(8, 16)
        marks = rng.random((200 // 2 + 1, 200 // 2 + 1)) < 0.45
        out = np.where(marks[(y // 2).astype(int), (x // 2).astype(int)] & (y % line < line * 0.6), 15.0, 90.0)
    elif kind == 3:
        f = 2 * np.pi / rng.uniform(3, 8)
        out = 50 + 15 * np.sin(f * x) * np.sign(np.sin(f * y)) + 4 * rng.standard_normal((200, 200))
    else:
        row = np.cumsum(rng.standard_normal((200, 1)), 0)
        out = 60 + 8 * rng.standard_normal((200, 1)) + row * 0.5 + 1.5 * rng.standard_normal((200, 200))
        out = (out + np.roll(out, 1, 1) + np.roll(out, 2, 1)) / 3
    return np.clip(out, 2, 98)


def transplanted(scene, seed, maps, refs):
    """The noise of these looks and references, halves and moments of the same draw, on another texture."""
    import zlib
    rng = np.random.default_rng(zlib.crc32(("%s %d" % (scene, seed)).encode()))
    clean, base = textured(int(rng.integers(5)), rng), (refs[0] + refs[1]) / 2
    out = np.array(maps, np.float32)
    for k in range(len(maps)):
        m = maps[k, 0] - base + clean
        out[k, 0], out[k, 3] = m, law.texture(m + maps[k, 1], m - maps[k, 1])
    return out, [r - base + clean for r in refs]


def render(job):
    scene, seed, work, out, deadline = job
    if time.time() > deadline:
        return scene, None
    part = os.path.join(work, "%s-%d" % (name_of(scene), seed))
    shutil.rmtree(part, ignore_errors=True)
    os.makedirs(part)
    file = file_of(scene)
    spp = ("--spp-max", SPP) if seed in SEEDS else ("--spp", REF)
    began = time.time()
    r = subprocess.run([str(a) for a in (tool.RENDER, "-q", file, "--size", "200x200", "--block", 200, "-c",
                        os.path.join(tool.BUILD, "tests", "abi", "plugins", "planes.so"), "-t", 1, "--seed", seed, *spp, "-o", os.path.join(part, "x.exr"))],
                       env=dict(os.environ, LULL_PLANES=part), capture_output=True, text=True)
    if r.returncode:
        print(scene, seed, r.stderr[-300:], flush=True)
        return scene, None
    spps, maps = [], []
    for path in sorted(glob.glob(os.path.join(part, "0-*.planes"))):
        data = open(path, "rb").read()
        w, h, n, half = struct.unpack("<4I", data[8:24])
        v = np.frombuffer(data, "<f4", offset=24).reshape(-1, h, w)
        mean, first = v[0:3].transpose(1, 2, 0), v[3:6].transpose(1, 2, 0)
        if seed in REFS:
            maps = [law.lightness(mean).astype(np.float32)]
            continue
        second = (n * mean - half * first) / (n - half)
        a, b = law.lightness(first), law.lightness(second)
        spps.append(n)
        maps.append(np.stack([law.lightness(mean), (a - b) * np.sqrt(half * (n - half)) / n, law.deviation(mean, v[12], n), law.texture(a, b)]).astype(np.float32))
    np.savez(os.path.join(work, "%s-%d.npz" % (name_of(scene), seed)), spp=np.array(spps), maps=np.array(maps))
    shutil.rmtree(part)
    print("%s %d %.0f s" % (scene, seed, time.time() - began), flush=True)
    return scene, seed


def rects():
    for size in (200, 100, 32):
        for j in range(200 // size):
            for i in range(200 // size):
                yield size, slice(j * size, (j + 1) * size), slice(i * size, (i + 1) * size)


def features(job):
    scene, seed, work, other = job
    z = np.load(os.path.join(work, "%s-%d.npz" % (name_of(scene), seed)))
    spp, maps = z["spp"], z["maps"]
    refs = [np.load(os.path.join(work, "%s-%d.npz" % (name_of(scene), s)))["maps"][0].astype(float) for s in REFS]
    if other:
        maps, refs = transplanted(scene, seed, maps, refs)
        np.savez(os.path.join(work, "%s-%d.npz" % (name_of(scene), seed + 10)), spp=spp, maps=maps)
    rows = []
    for k, n in enumerate(spp):
        m, d, v, t = maps[k].astype(float)
        row = []
        for size, y, x in rects():
            shared = law.texture(refs[0][y, x], refs[1][y, x])
            true = law.true(m[y, x], refs[0][y, x], refs[1][y, x], shared) / LEVEL
            tex = t[y, x]
            halves = law.noise(d[y, x], tex) / LEVEL
            moments = law.expected(v[y, x] ** 2, tex) / LEVEL
            e = v[y, x] ** 2
            peak = np.sqrt((e ** 2).mean()) / max(e.mean(), 1e-12)
            change = []
            for lag in range(1, 6):
                if k >= lag:
                    j = k - lag
                    change.append(law.noise((m - maps[j, 0])[y, x] * np.sqrt(spp[j] / (n - spp[j])), tex) / LEVEL)
                else:
                    change.append(np.nan)
            row.append((true, halves, moments, peak, tex.mean(), *change))
        rows.append(row)
    np.savez(os.path.join(work, "rows-%s-%d.npz" % (name_of(scene), seed + 10 * other)), rows=np.array(rows), flags=effects(scene))
    return scene, seed


def record(work, out):
    from concurrent.futures import ProcessPoolExecutor, as_completed
    os.makedirs(work, exist_ok=True)
    deadline = time.time() + float(os.environ.get("RENDER_S", "1e9"))
    with ProcessPoolExecutor(CORES) as pool:
        wait, done, more = {}, {}, []
        for scene in order():
            for seed in (*REFS, *SEEDS):
                if not os.path.exists(os.path.join(work, "%s-%d.npz" % (name_of(scene), seed))):
                    wait[pool.submit(render, (scene, seed, work, out, deadline))] = scene
                else:
                    done.setdefault(scene, set()).add(seed)
        def ready(scene):
            if len(done.get(scene, ())) == 4:
                for s, other in [(s, False) for s in SEEDS] + [(SEEDS[0], True)]:
                    if not os.path.exists(os.path.join(work, "rows-%s-%d.npz" % (name_of(scene), s + 10 * other))):
                        more.append(pool.submit(features, (scene, s, work, other)))
        for scene in list(done):
            ready(scene)
        for f in as_completed(wait):
            scene, seed = f.result()
            if seed:
                done.setdefault(scene, set()).add(seed)
                ready(scene)
        for f in more:
            f.result()
    full = [s for s in order() if len(done.get(s, ())) == 4]
    print("whole scenes: %d of %d: %s" % (len(full), len(order()), " ".join(full)), flush=True)


# --- networks ---------------------------------------------------------------------------------------------------------------


def load(work):
    data = []
    for scene in order():
        for seed in (*SEEDS, 11):
            paths = [os.path.join(work, "%s%s-%d.npz" % (p, name_of(scene), seed)) for p in ("", "rows-")]
            if all(map(os.path.exists, paths)):
                z, r = np.load(paths[0]), np.load(paths[1])
                data.append((name_of(scene), seed, z["spp"], z["maps"], r["rows"], r["flags"]))
    return data


def scalars(spp, rows, k):
    """[41, F] of look k."""
    r = rows[:, :, 0:10]
    log = lambda x: np.log2(np.maximum(x, 1e-3))
    tog = np.sqrt(0.8 * r[:, :, 1] ** 2 + 0.2 * r[:, :, 2] ** 2)
    window = [tog[max(k - j, 0)] * np.sqrt(spp[max(k - j, 0)] / spp[k]) for j in range(6)]
    now = log(tog[k])
    change = [np.where(np.isnan(r[k, :, 5 + j]), 0, log(np.nan_to_num(r[k, :, 5 + j])) - now) for j in range(5)]
    f = [log(r[k, :, 1]) - now, log(r[k, :, 2]) - now, log(np.max(window, 0)) - now, log(np.mean(window, 0)) - now,
         log(window[1]) - now, log(window[5]) - now, np.std(log(np.array(window)), 0), *change, log(r[k, :, 3]) / 4, log(r[k, :, 4] + 2) / 4,
         (log(tog[k, 0]) - now) / 2, (log(r[k, 0, 2]) - now) / 2, np.full(41, min(k, 5) / 5.0), now / 4,
         np.arange(41) == 0, (np.arange(41) > 0) & (np.arange(41) < 5)]
    return np.stack(f, 1).astype(np.float32), now.astype(np.float32)


def pictures(data):
    """Maps float16 [P, 10, 200, 200], scalars, base, target, keys."""
    maps, sc, base, target, keys = [], [], [], [], []
    squash = lambda x: np.sign(x) * np.log1p(np.abs(x))
    for scene, seed, spp, m, rows, flags in data:
        for k, n in enumerate(spp):
            tex = m[k, 3]
            s = np.empty_like(tex)
            for p in law.patches(200, 200):
                s[p] = tex[p].mean()
            c = 1 / (LEVEL * np.sqrt(s + 2))
            chan = [squash(m[k, 1] * c), np.log1p(m[k, 2] * c), np.log2(tex + 2) / 4]
            for lag in range(1, 6):
                j = k - lag
                chan.append(squash((m[k, 0] - m[j, 0]) * c * np.sqrt(spp[j] / (n - spp[j]))) if j >= 0 else np.zeros_like(tex))
            for lag in (1, 3):
                j = k - lag
                chan.append(np.log1p(np.abs(m[j, 1]) * c * np.sqrt(spp[j] / n)) if j >= 0 else np.zeros_like(tex))
            maps.append(np.stack(chan).astype(np.float16))
            f, now = scalars(spp, rows, k)
            f = np.concatenate([f, np.tile(flags, (41, 1))], 1)
            sc.append(f)
            base.append(now)
            target.append(np.log2(np.clip(rows[k, :, 0], 0.02, 50)).astype(np.float32))
            keys.append((scene, seed, int(n)))
    return np.array(maps), np.array(sc), np.array(base), np.array(target), keys


def network(torch, channels, scalars):
    nn = torch.nn

    class Net(nn.Module):
        def __init__(self):
            super().__init__()
            c = lambda a, b: nn.Conv2d(a, b, 3, padding=1)
            self.trunk = MAPS and nn.Sequential(c(channels, 24), nn.ReLU(), c(24, 24), nn.ReLU(), nn.AvgPool2d(2), c(24, 32), nn.ReLU(), c(32, 32), nn.Softplus())
            self.head = nn.Sequential(nn.Linear(32 * 6 * MAPS + scalars, 64), nn.ReLU(), nn.Dropout(0.3), nn.Linear(64, 32), nn.ReLU(), nn.Linear(32, 2))
            nn.init.zeros_(self.head[-1].weight)
            nn.init.zeros_(self.head[-1].bias)

        def pooled(self, x, sixth, size):
            n = 200 // size * size // 2
            x, sixth = x[:, :, :n, :n], sixth[:, :, :n, :n]
            k = size // 2
            pool = torch.nn.functional.avg_pool2d
            stats = [torch.log(pool(x, k) + 1e-3), torch.log(pool(sixth, k) + 1e-6) / 6, torch.log(torch.nn.functional.max_pool2d(x, k) + 1e-3)]
            return torch.cat(stats, 1).flatten(2).transpose(1, 2)  # [B, blocks, 96]

        def forward(self, x, f, turn):
            if not MAPS:
                return self.head(f)
            if turn & 1:
                x = x.flip(2)
            if turn & 2:
                x = x.flip(3)
            if turn & 4:
                x = x.transpose(2, 3)
            y = self.trunk(x).float()
            if turn & 4:
                y = y.transpose(2, 3)
            if turn & 2:
                y = y.flip(3)
            if turn & 1:
                y = y.flip(2)
            sixth = (y * y * y) ** 2
            whole = self.pooled(y, sixth, 200)
            own = torch.cat([whole, self.pooled(y, sixth, 100), self.pooled(y, sixth, 32)], 1)
            return self.head(torch.cat([own, whole.expand(-1, 41, -1), f], 2))

    return Net()


def fold_of(scene):
    names = sorted(name_of(s) for s in POOL)
    return names.index(scene) % 5 if scene in names else -1


def train_one(torch, device, data, fold, seed, epochs, maps_on):
    maps, sc, base, target, keys = data
    if not FLAGS:
        sc = sc[:, :, :-len(EFFECTS)]
    folds = np.array([fold_of(k[0]) for k in keys])
    inside = np.flatnonzero((folds >= 0) & (folds != fold))
    outside = np.flatnonzero(folds == (fold if fold < 5 else -1))
    torch.manual_seed(100 * fold + seed)
    rng = np.random.default_rng(100 * fold + seed)
    net = network(torch, maps.shape[1], sc.shape[2]).to(device, memory_format=torch.channels_last)
    optimizer = torch.optim.AdamW(net.parameters(), lr=2e-3, weight_decay=1e-2)
    batch = min(BATCH, len(inside))
    steps = epochs * (len(inside) // batch)
    schedule = torch.optim.lr_scheduler.OneCycleLR(optimizer, 2e-3, total_steps=steps)
    t = lambda a: torch.from_numpy(a).to(device)
    scd, based, targetd = t(sc), t(base), t(target)
    weight = torch.exp(-((based - np.log2(0.93)) ** 2) / 2)
    share = torch.cat([torch.full((1,), 1.0), torch.full((4,), 0.5), torch.full((36,), 0.15)]).to(device)
    net.train()
    for epoch in range(epochs):
        perm = rng.permutation(inside)
        for i in range(0, len(perm) // batch * batch, batch):
            idx = torch.from_numpy(perm[i:i + batch]).to(device)
            with torch.autocast(device, dtype=torch.bfloat16):
                out = net((maps_on[idx].float().contiguous(memory_format=torch.channels_last) if MAPS else None), scd[idx], int(rng.integers(8))).float()
            miss = targetd[idx] - based[idx] - out[..., 0]
            high = targetd[idx] - based[idx] - out[..., 1]
            loss = torch.nn.functional.huber_loss(miss, torch.zeros_like(miss), delta=0.3, reduction="none") + 0.3 * torch.maximum(0.9 * high, -0.1 * high)
            w = weight[idx] * share
            loss = (loss * w).sum() / w.sum()
            optimizer.zero_grad()
            loss.backward()
            torch.nn.utils.clip_grad_norm_(net.parameters(), 1.0)
            optimizer.step()
            schedule.step()
    net.eval()
    answers = []
    with torch.no_grad():
        for i in range(0, len(outside), batch):
            idx = torch.from_numpy(outside[i:i + batch]).to(device)
            with torch.autocast(device, dtype=torch.bfloat16):
                out = sum(net((maps_on[idx].float().contiguous(memory_format=torch.channels_last) if MAPS else None), scd[idx], turn).float() for turn in (0, 3, 5, 6))
            answers.append(out.cpu().numpy() / 4 + base[outside[i:i + batch], :, None])
    return outside, np.concatenate(answers) if answers else np.zeros((0, 41, 2)), float(loss)


def work_on(args):
    import torch
    torch.set_num_threads(1)
    path, jobs, out, epochs = args
    device = "cuda" if torch.cuda.is_available() else "cpu"
    data = [np.load(os.path.join(path, "p%d.npy" % i)) for i in range(4)]
    keys = [tuple(k) for k in json.load(open(os.path.join(path, "keys.json")))]
    maps_on = torch.from_numpy(data[0]).to(device)
    for fold, seed in jobs:
        if os.path.exists(os.path.join(path, "%s-%d-%d.npz" % (KIND, fold, seed))):
            continue
        began = time.time()
        outside, answers, loss = train_one(torch, device, (*data, keys), fold, seed, epochs, maps_on)
        np.savez(os.path.join(path, "%s-%d-%d.npz" % (KIND, fold, seed)), outside=outside, answers=answers.astype(np.float32))
        print("fold %d seed %d: loss %.4f, %.0f s" % (fold, seed, loss, time.time() - began), flush=True)


def train(work, out):
    from concurrent.futures import ProcessPoolExecutor
    began = time.time()
    everything = load(work)
    path = os.path.join(work, "pictures")
    os.makedirs(path, exist_ok=True)
    with ProcessPoolExecutor(CORES) as pool:
        parts = list(pool.map(pictures, [[d] for d in everything]))
    data = [np.concatenate([p[i] for p in parts]) for i in range(4)]
    keys = [k for p in parts for k in p[4]]
    for i in range(4):
        np.save(os.path.join(path, "p%d.npy" % i), data[i])
    json.dump(keys, open(os.path.join(path, "keys.json"), "w"))
    print("pictures: %s, %.0f s" % (data[0].shape, time.time() - began), flush=True)
    np.savez_compressed(os.path.join(out, "rows.npz"), keys=np.array(json.dumps(keys)), scalars=data[1].astype(np.float32), base=data[2], target=data[3],
                        rows=np.concatenate([d[4] for d in everything]).astype(np.float32))
    jobs = [(fold, seed) for seed in range(int(os.environ.get("SEEDS", "5"))) for fold in range(6)]
    if QUICK:
        jobs = jobs[:2]
    lanes = int(os.environ.get("LANES", "2"))
    import multiprocessing
    with ProcessPoolExecutor(lanes, mp_context=multiprocessing.get_context("spawn")) as pool:
        list(pool.map(work_on, [(path, jobs[i::lanes], out, int(os.environ.get("EPOCHS", "8"))) for i in range(lanes)]))
    found = {os.path.basename(p)[len(KIND) + 1:-4]: np.load(p) for p in glob.glob(os.path.join(path, KIND + "-*.npz"))}
    np.savez_compressed(os.path.join(out, KIND + ".npz"), **{"%s/%s" % (k, a): z[a] for k, z in found.items() for a in z.files})
    print("trained %d networks, %.0f s" % (len(found), time.time() - began), flush=True)


# --- judging


def judge(out, groups):
    z = np.load(os.path.join(out, "rows.npz")); keys = [tuple(k) for k in json.loads(str(z["keys"]))]
    sc, base, target, rows = z["scalars"], z["base"], z["target"], z["rows"]
    P = len(keys); scene = np.array([k[0] for k in keys]); seed = np.array([k[1] for k in keys]); spp = np.array([k[2] for k in keys])
    true = rows[:, :, 0]; h = rows[:, :, 1]; m = rows[:, :, 2]
    fold = np.array([fold_of(s) for s in scene])
    LIMIT = 0.89
    nets = np.load(os.path.join(out, KIND + ".npz")); ans = {}
    for key in nets.files:
        f, s = key.split("/")[0].split("-")
        ans.setdefault(int(s), {})[int(f)] = (nets["%s-%s/outside" % (f, s)], nets["%s-%s/answers" % (f, s)])
    pred = np.full((5, P, 41, 2), np.nan, np.float32)
    for s, d in ans.items():
        for f, (o, a) in d.items():
            pred[s, o] = a
    cnn = np.nanmean(pred[..., 0], 0); se = np.nanstd(pred[..., 0], 0, ddof=1) / np.sqrt(len(ans)); q90 = np.nanmean(pred[..., 1], 0)
    tog = 2 ** base

    def linear(cols):
        out = np.zeros((P, 41)); X = np.concatenate([sc[:, :, cols], np.ones((P, 41, 1))], 2)
        w = np.exp(-((base - np.log2(LIMIT)) ** 2) / 2) * np.r_[1, [.5] * 4, [.15] * 36]
        res = np.clip(target - base, -2, 2)
        for s in sorted(set(scene)):
            tr = (fold >= 0) & (scene != s); te = scene == s
            A = X[tr].reshape(-1, X.shape[2]); W = w[tr].ravel()
            G = (A * W[:, None]).T @ A + 1e-3 * W.sum() * np.eye(A.shape[1]); b = np.linalg.solve(G, (A * W[:, None]).T @ res[tr].ravel())
            out[te] = (X[te] @ b) + base[te]
        return 2 ** out

    RULES = {"observer": tog, "halves": h, "moments": m, "linear h, m": linear([0, 1]), "linear all": linear(list(range(20))), "linear and flags": linear(list(range(sc.shape[2]))),
             "network": 2 ** cnn, "network + se": 2 ** (cnn + se), "network q90": 2 ** q90}
    for s in range(5): RULES["network, seed %d" % s] = 2 ** pred[s, :, :, 0]
    SIZE = np.r_[200, [100] * 4, [32] * 36]
    def stops(score, c, pick, seeds=(1, 2)):
        """[(n, true)] n = 0: none. score [P,41]; the window: the whole picture's together at most 3 c' where c' is the limit"""
        out = []
        for s in sorted(set(scene[pick])):
            for sd in seeds:
                i = np.flatnonzero((scene == s) & (seed == sd)); i = i[np.argsort(spp[i])]
                ok = score[i] <= c
                ok &= ~((tog[i, :1] > 3 * LIMIT) & (SIZE[None] < 200))
                first = np.argmax(ok, 0); hit = ok.any(0)
                out.append((np.where(hit, spp[i][first], 0), np.where(hit, true[i][first, np.arange(41)], np.nan)))
        return np.array([o[0] for o in out]), np.array([o[1] for o in out])
    def summary(n, e, cols):
        n, e = n[:, cols].ravel(), e[:, cols].ravel(); hit = n > 0
        k = max(hit.sum(), 1)
        return dict(stops=int(hit.sum()), off=100 * (e[hit] > 1.05).sum() / k, off12=100 * (e[hit] > 1.12).sum() / k, worst=e[hit].max() if hit.any() else 0, wrong=int((e[hit] > 1.05).sum()))
    GROUPS = {"left out": [s for s in set(scene) if fold_of(s) >= 0 and not s.startswith(("rare", "foreign"))], "rare light": [s for s in set(scene) if s.startswith("rare")],
              "foreign": [s for s in set(scene) if s.startswith("foreign")], "test": [s for s in set(scene) if fold_of(s) < 0]}
    def octaves(n, n0, cols):
        a, b = np.where(n == 0, 609, n)[:, cols], np.where(n0 == 0, 609, n0)[:, cols]
        return (np.log2(a) - np.log2(b)).mean()
    GROUPS["transplanted"] = [s for s in set(scene) if fold_of(s) >= 0]
    CS = np.geomspace(0.4, 2.2, 45)
    for g in groups or ("left out", "rare light", "foreign", "test", "transplanted"):
        seeds = (11,) if g == "transplanted" else (1, 2)
        pick = np.isin(scene, GROUPS[g]) & np.isin(seed, seeds)
        for size in (200, 100, 32):
            cols = np.flatnonzero(SIZE == size)
            n0, e0 = stops(tog, LIMIT, pick, seeds); o = summary(n0, e0, cols)
            print("\n%s, %d px: observer %d stops of %d, wrong %d (%.1f %%), 1.12 %.1f, worst %.2f" % (g, size, o["stops"], n0[:, cols].size, o["wrong"], o["off"], o["off12"], o["worst"]))
            for name, score in RULES.items():
                if np.isnan(score[pick]).all(): continue
                curve = []
                for c in CS:
                    n, e = stops(score, c, pick, seeds); r = summary(n, e, cols)
                    curve.append((octaves(n, n0, cols), r["wrong"], r["off12"], r["worst"], r["stops"], c))
                x = np.array([k[0] for k in curve]); wr = np.array([k[1] for k in curve], float)
                order = np.argsort(x)
                equal = np.interp(0, x[order], wr[order])
                # samples at equal reliability: largest c whose wrong stops, and those of all stricter, are no more than the observer's
                good = [k for j, k in enumerate(curve) if all(curve[q][1] <= o["wrong"] for q in range(j + 1))]
                i0 = np.argmin(abs(x))
                print("  %-16s equal samples: wrong %.1f (1.12 %.1f %%, worst %.2f); equal wrong: samples %s" % (name, equal, curve[i0][2], curve[i0][3], "%.2f" % 2 ** good[-1][0] if good else "-"))


if __name__ == "__main__":
    work = sys.argv[2]
    judge(work, sys.argv[3:]) if sys.argv[1] == "judge" else {"record": record, "train": train}[sys.argv[1]](work, work)
