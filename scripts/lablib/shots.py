"""Compares shots by a table, by decisions frame by frame and with the same samples everywhere, as still and moving pictures.

Films of 24 frames are written from scenes/, rendered in all these ways, raw and denoised, and compared with clips of many samples. The
images stay in --work: interrupted, the same command goes on. Needs scripts/setup --judge, and --denoiser for the denoised ones."""
import math
import os
import re
import resource
import statistics

from lablib import cvvdp, tables, tool
from lablib.sources import OBSERVER, PICTURES

SOURCES = PICTURES + OBSERVER + ("plugin-api/host/mask.c",)
FRAMES, EVERY, SIZE, BLOCK, FPS = 24, 8, 64, 16, 24
REFERENCE_SPP = 256
UNIFORM = 1.5, 3  # of the mean samples of decisions frame by frame: between the two, quality is interpolated


# --- films: of a scene, what changes from its first frame (u = 0) to its last (u = 1) ---

def move_lamp(text, u):
    return text.replace("Translate 1.5 4 -1", "Translate %.4f 4 -1" % (1.5 - 2 * u))


def walk(text, u):
    return text.replace("LookAt -6 2.2 -9  0.5 1.7 2", "LookAt %.4f 2.2 -9  %.4f 1.7 2" % (-6 + 3 * u, 0.5 + 1.5 * u))


def roll_ball(text, u):
    return text.replace("Translate 0.9 0.5 1.4", "Translate %.4f 0.5 1.4" % (0.9 - 2.2 * u))


def move_pieces(text, u):
    text = text.replace("Translate -0.2 0 -0.2 ", "Translate -0.2 0 %.4f " % (-0.2 - 0.8 * u))
    return re.sub(r"Translate 0\.6 (\S+) 0\.2", lambda found: "Translate %.4f %s %.4f" % (0.6 - 1.4 * u, found[1], 0.2 - 1.2 * u), text)


KEPT = {"raw": ("", ()), "denoised": ("denoised-", ("--denoise",))}  # prefix of names; options
FILMS = {"lamp": ("soft-shadow", move_lamp, "a lamp moves over a lattice"), "walk": ("plaza", walk, "the camera walks past columns"),
         "ball": ("soft-shadow", roll_ball, "a ball rolls behind a lattice"), "pieces": ("chess", move_pieces, "two chess pieces slide")}


def options(parser):
    parser.add_argument("--only", type=lambda text: text.split(","), default=list(FILMS), metavar="FILMS", help="some of " + ", ".join(FILMS))
    parser.add_argument("--kept", type=lambda text: text.split(","), default=list(KEPT), metavar="PICTURES", help="raw, denoised or both")
    parser.add_argument("--work", type=tool.path, default=os.path.join(tool.BUILD, "shots"), help="where images are kept (build/shots)")
    parser.add_argument("--render-only", action="store_true", help="render what is missing, compare nothing")
    tool.writes(parser)


def write_frames(film, folder):
    scene, change, _ = FILMS[film]
    os.makedirs(folder, exist_ok=True)
    for beside in ("parts", "textures", "meshes"):  # names in a scene are relative to it
        if not os.path.lexists(os.path.join(folder, beside)):
            os.symlink(os.path.join(tool.ROOT, "scenes", beside), os.path.join(folder, beside))
    with open(os.path.join(tool.ROOT, "scenes", scene + ".pbrt"), encoding="utf-8") as file:
        text = file.read()
    for i in range(FRAMES):
        changed = change(text, i / (FRAMES - 1))
        if changed == change(text, 2.0):
            raise tool.Refused("scenes/%s.pbrt: nothing in it moves as in the film %s" % (scene, film))
        with open(os.path.join(folder, "scene_%04d.pbrt" % (i + 1)), "w", encoding="utf-8") as file:
            file.write(changed)


# --- rendering ---

class Film:
    def __init__(self, name, work):
        self.name, self.folder = name, os.path.join(work, name)
        write_frames(name, self.folder)

    def path(self, *names):
        return os.path.join(self.folder, *names)

    def command(self, *more):
        return [tool.RENDER, self.path("scene_%04d.pbrt"), "-q", "--frames", "1-%d" % FRAMES, "--size", "%dx%d" % (SIZE, SIZE),
                "--block", BLOCK, "--light-selection", "hierarchy", *more]

    def render(self, way, *more):
        """Frames that are there stay."""
        names = [self.path(way + "_%04d" + end) for end in (".exr", ".json", ".png")]
        if not os.path.exists(names[0] % FRAMES):
            tool.run(*self.command("-o", names[0], "--report", names[1], "--preview", names[2], *more))

    def plan(self, way, *more):
        """The table; what it cost stands beside."""
        table = self.path(way + ".csv")
        if not os.path.exists(table):
            before = resource.getrusage(resource.RUSAGE_CHILDREN)
            tool.run(*self.command("--plan-shot", table + ".part", "--plan-every", EVERY, *more))
            after = resource.getrusage(resource.RUSAGE_CHILDREN)
            tool.save({"seconds": after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime}, table + ".json")
            os.replace(table + ".part", table)
        return table

    def report(self, way, frame):
        return tool.load(self.path("%s_%04d.json" % (way, frame)))

    def samples(self, way):
        """Of each block, frame by frame."""
        return [[b["spp"] for b in self.report(way, f)["blocks"]] for f in range(1, FRAMES + 1)]

    def seconds(self, way):
        """Processor seconds of its sampling and its decisions."""
        reports = [self.report(way, f) for f in range(1, FRAMES + 1)]
        return sum(sum(b["thread_s"] for b in r["blocks"]) + r["totals"]["criterion_thread_s"] for r in reports)

    def pictures(self, way):
        return [self.path("%s_%04d.png" % (way, f)) for f in range(1, FRAMES + 1)]


def render_all(film, kept):
    for prefix, more in (KEPT[kind] for kind in kept):
        asked = (*more, "-p", "fps=%d" % FPS)
        film.render(prefix + "criterion", *asked)
        mean = statistics.mean(map(statistics.mean, film.samples(prefix + "criterion")))
        for k, factor in enumerate(UNIFORM):
            film.render("%suniform-%d" % (prefix, k), "--spp", round(factor * mean), *more)
        film.render(prefix + "table", "--shot-table", film.plan(prefix + "plan", *asked), *more)
    film.render("reference", "--spp", REFERENCE_SPP, "--seed", 1)


# --- comparing ---

def steps(samples):
    """Mean octaves from frame to frame."""
    return statistics.mean(abs(math.log2(b / a)) for x, y in zip(samples, samples[1:]) for a, b in zip(x, y))


def table_beside(table, criterion):
    """What a table gives where it was not asked, against what the criterion would."""
    pilots = {*range(0, FRAMES, EVERY), FRAMES - 1}
    between = [f for f in range(FRAMES) if f not in pilots]
    ratios = [t / c for f in between for t, c in zip(table[f], criterion[f])]
    repeated = [b / a for x, y in zip(criterion, criterion[1:]) for a, b in zip(x, y)]
    return {"between": sum(sum(table[f]) for f in between) / sum(sum(criterion[f]) for f in between),
            "short": sum(r < 0.8 for r in ratios) / len(ratios), "repeated_short": sum(r < 0.8 for r in repeated) / len(repeated),
            "step_table": steps(table), "step_criterion": steps(criterion)}


def flicker(pictures, references):
    """Mean square of how the step of noise between two neighbouring blocks changes from a frame to the next; and its share of the mean
    square of the noise. Noise: the root mean square over a block of the difference to the reference, in sRGB codes of luminance."""
    import numpy
    from PIL import Image
    noise = []
    for picture, reference in zip(pictures, references):
        a, b = (numpy.asarray(Image.open(name).convert("L"), dtype=float) for name in (picture, reference))
        across, down = a.shape[1] // BLOCK, a.shape[0] // BLOCK
        noise.append(numpy.sqrt(((a - b) ** 2).reshape(down, BLOCK, across, BLOCK).mean(axis=(1, 3))))
    edges = [numpy.concatenate([(n[1:] - n[:-1]).ravel(), (n[:, 1:] - n[:, :-1]).ravel()]) for n in noise]
    energy = float(numpy.mean([((y - x) ** 2).mean() for x, y in zip(edges, edges[1:])]))
    return energy, energy / float(numpy.mean(numpy.square(noise)))


def judged(film, judge, way, reference):
    energy, share = flicker(film.pictures(way), reference)
    return {"jod": judge.jod(film.pictures(way), reference, fps=FPS), "flicker": energy, "flicker_share": share,
            "seconds": film.seconds(way), "spp": statistics.mean(map(statistics.mean, film.samples(way)))}


def against_uniform(found, low, high):
    """Ratios to uniform sampling of the same JOD, whose logarithms lie on a line with that of the lost JODs through two renders."""
    lost = [math.log(10 - x["jod"]) for x in (low, high)]
    at = (math.log(10 - found["jod"]) - lost[0]) / (lost[1] - lost[0])
    like = {key: math.exp(math.log(low[key]) + at * (math.log(high[key]) - math.log(low[key]))) for key in ("seconds", "spp", "flicker", "flicker_share")}
    return {**{key: found[key] / like[key] for key in like}, "place": at}


def compare(film, kept, judge):
    reference, found = film.pictures("reference"), {}
    for kind in kept:
        prefix = KEPT[kind][0]
        uniform = [judged(film, judge, "%suniform-%d" % (prefix, k), reference) for k in range(len(UNIFORM))]
        ways = {way: judged(film, judge, prefix + way, reference) for way in ("criterion", "table")}
        plan_s = tool.load(film.path(prefix + "plan.csv.json"))["seconds"]
        found[kind] = {"uniform": uniform, "pilots": plan_s / (plan_s + ways["table"]["seconds"]),
                       **{way: {**w, "against": against_uniform(w, *uniform)} for way, w in ways.items()},
                       "beside": table_beside(numbers(film.path(prefix + "plan.csv")), film.samples(prefix + "criterion"))}
    return found


def rows_of(results):
    for name, film in results["films"].items():
        for kind, found in film.items():
            yield name, kind, found


def page(results):
    """Judged by ColorVideoVDP."""
    heads = ("film", "kept", "JOD frame by frame", "table", "time over uniform's at its JOD, frame by frame", "table",
             "edge flicker over uniform's, frame by frame", "table", "as a share of the noise, frame by frame", "table",
             "pilots, of the shot's time")
    rows = [[name, kind, *("%.2f" % r[way]["jod"] for way in ("criterion", "table")),
             *("%.2f" % r[way]["against"][key] for key in ("seconds", "flicker", "flicker_share") for way in ("criterion", "table")), tables.percent(r["pilots"])]
            for name, kind, r in rows_of(results)]
    return tables.table(heads, rows) + "\n%s.\n" % tables.provenance(results["measured"])


def beside(results):
    """Samples of tables beside those of the criterion."""
    heads = ("film", "kept", "samples of the table over the criterion's, between pilots", "blocks with less than 0.8 of its",
             "the criterion's own, a frame later", "octaves from frame to frame: table", "criterion")
    rows = [[name, kind, "%.2f" % b["between"], tables.percent(b["short"]), tables.percent(b["repeated_short"]), "%.2f" % b["step_table"],
             "%.2f" % b["step_criterion"]] for name, kind, r in rows_of(results) for b in [r["beside"]]]
    return tables.table(heads, rows)


def numbers(name):
    with open(name, encoding="utf-8") as file:
        return [[int(x) for x in line.split(";")[1:]] for line in file if re.match(r"\d+;\d", line)]


def main(o):
    if not o.render_only and cvvdp.missing():
        raise tool.Refused(cvvdp.missing())
    films = {}
    for name in o.only:
        film = Film(name, o.work)
        render_all(film, o.kept)
        if not o.render_only:
            with cvvdp.Judge() as judge:
                films[name] = compare(film, o.kept, judge)
            for kind, found in films[name].items():
                for way in ("criterion", "table"):
                    print(name, kind, way, "JOD %.3f, over uniform's:" % found[way]["jod"],
                          *("%s %.2f" % pair for pair in found[way]["against"].items()), flush=True)
    if o.write:
        tool.store(o.write, "shots", {"measured": tool.measured(), "films": films})
