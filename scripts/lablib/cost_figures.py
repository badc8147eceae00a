"""Figures of docs/results/cost.md from what `lab cost` measured (docs/results/cost.json)."""
import math
import statistics

BLOCK = 200 * 200


def median(values):
    values = [v for v in values if v is not None and math.isfinite(v)]
    return statistics.median(values) if values else math.nan


def mean(values):
    values = [v for v in values if v is not None and math.isfinite(v)]
    return statistics.fmean(values) if values else math.nan


def bare(criterion):
    """Without what it went without."""
    return criterion.replace(", no guard", "").replace(", no halves", "")


def price_of(out, criterion):
    prices = out.get("prices", {})
    name = bare(criterion)
    return prices.get(name, {"check_s": 0.0})["check_s"] if name != "limit" else 0.0


def points_of(out, name):
    return points_in(out, out["sets"][name])


def points_in(out, data):
    """[(criterion, parameter, value, {scene: figures}, whether it is what a user gets who says nothing else)] with what the checks
    cost: check_s, total_s, overhead, total_ratio, and to_limit, the time against that of stopping every block exactly at its threshold."""
    named = lambda scenes: {scene: dict(zip(data["keys"], f)) for scene, f in scenes.items()}
    limit = named(next(p for p in data["points"] if p["criterion"] == "limit")["scenes"])
    points = []
    for p in data["points"]:
        full = price_of(out, p["criterion"])
        network = out.get("networks", {}).get(bare(p["criterion"]))
        scenes = {}
        for scene, f in named(p["scenes"]).items():
            f["check_s"] = f["checks_full"] * full
            if network and f["checks_full"] > 0:  # a first window has all of its images denoised, later ones one
                f["check_s"] += (network["window"] - 1) * network["denoiser"] * full
            if f["sampling_s"]:
                f["total_s"] = f["sampling_s"] + f["check_s"]
                f["overhead"] = f["check_s"] / f["total_s"]
                f["total_ratio"] = f["time_ratio"] * f["total_s"] / f["sampling_s"]
                f["to_limit"] = f["total_s"] / limit[scene]["sampling_s"]
            else:  # recorded without times: samples stand for them, and checks are free
                f["total_s"], f["overhead"], f["total_ratio"] = f["samples"], 0.0, f["samples_ratio"]
                f["to_limit"] = f["samples"] / limit[scene]["samples"]
            f["limit"] = limit[scene]["time_ratio"] if f["sampling_s"] else limit[scene]["samples_ratio"]
            scenes[scene] = f
        points.append((p["criterion"], p["dial"], p["value"], scenes, is_own(out, p["criterion"], p["dial"], p["value"])))
    return points


def is_own(out, criterion, dial, value):
    """Of criteria whose defaults the renderer told: those, with halves or without; of models: their own."""
    wanted = out["defaults"].get(criterion.replace(", no halves", ""))
    return [dial, value] == wanted if wanted else dial == "own"


def is_default(point):
    return point[4]


def over_scenes(point, key, how=median):
    return how([f.get(key) for f in point[3].values()])


def saving(p):
    """Checks' thread seconds per block at this setting, and samples per pixel saved against uniform of the same worst block."""
    spent = median([f["check_s"] for f in p[3].values()])
    saved = median([f["uniform_spp"] - f["samples"] for f in p[3].values()])
    return spent, saved


def at_path_cost(p, us):
    """Time against uniform samples of the same worst block if every path took `us` microseconds: median of the scenes with several
    blocks, one block's time being the same at any number of samples."""
    return median([(f["samples"] + f["check_s"] / (BLOCK * us * 1e-6)) / f["uniform_spp"] for f in p[3].values() if f["blocks"] > 1])


SIDES = ("25", "50", "100", "200", "400")


def limits_by_side(out, name):
    """{side: [mean(T)/max(T) of each scene]}: scenes with several blocks of 200 pixels."""
    parts = {scene: p for scene, p in out["sets"].get(name, {}).get("parts", {}).items() if len(p["200"]) > 1}
    return {side: [mean(p[side]) / max(p[side]) for p in parts.values() if len(p.get(side, ())) > 1] for side in SIDES}


def on_frontier(points, default):
    """Scenes on which no setting of another criterion is cheaper and as accurate in every column, of how many; and who is."""
    good, beaten = 0, {}
    for scene, f in default[3].items():
        by = [p for p in points if bare(p[0]) not in ("limit", default[0]) and scene in p[3] and p[3][scene]["total_s"] < 0.99 * f["total_s"]
              and p[3][scene]["worst"] <= f["worst"] and p[3][scene]["noisy"] <= f["noisy"]]
        good += not by
        if by:
            beaten[scene] = min(by, key=lambda p: p[3][scene]["total_s"])
    return good, len(default[3]), beaten


def find(points, criterion):
    return next((p for p in points if p[0] == criterion and is_default(p)), None)
