"""ColorVideoVDP's opinion of pictures and clips: how much worse one looks than its reference, on a given display.

Mantiuk, Hanji, Ashraf, Asano, Chapiro, "ColorVideoVDP: A visual difference predictor for image, video and display distortions", ACM
Transactions on Graphics 43(4), 2024. Its program is in build/judge (scripts/setup --judge), with a Python of its own: this module starts
that Python on this file, and speaks to it in lines of JSON. A quality is in JOD: 10 is no difference seen, 9 is one that three of four
viewers see.

    why = cvvdp.missing()                                          # None, or why there is none, in one line
    with cvvdp.Judge(ppd=67) as judge:
        judge.jod("noisy.png", "reference.exr")                    # two pictures
        judge.jod(frames, references, fps=24)                      # two clips, lists of pictures
        judge.jod("noisy.npy", "reference.png", block=40)          # (JOD, difference of each block of 40x40 pixels, in rows)

A picture is a PNG of 8 bits, an EXR of linear light (shown as such a PNG, clamped), or an .npy of [height][width][3] in [0, 1], sRGB as
a display gets it. The difference of a block is the root of the mean square, over its pixels and all frames, of a tenth of the JODs that
are lost there."""
import json
import os
import subprocess
import sys
import tempfile

PPD = 67.02064327657925  # 0.7 m from a screen 0.7 m wide with 3840 pixels, as in ggn/sight/flip.h
PEAK, CONTRAST, AMBIENT = 200, 1000, 250  # cd/m2, of it to black, lux: its display standard_4k


# --- in this Python ---

def python():
    from lablib import tool
    return os.path.join(tool.BUILD, "judge", "bin", "python")


def missing():
    from lablib import tool
    return None if os.path.exists(python()) else "no ColorVideoVDP in %s: scripts/setup --judge" % os.path.relpath(
        os.path.join(tool.BUILD, "judge"), tool.ROOT)


class Judge:
    """A process that is asked. ppd: pixels of the display per degree; peak: its white in cd/m2."""

    def __init__(self, ppd=PPD, peak=PEAK):
        from lablib import tool
        if missing():
            raise tool.Refused(missing())
        self.refused = tool.Refused
        self.process = subprocess.Popen([python(), os.path.abspath(__file__), repr(float(ppd)), repr(float(peak))], text=True,
                                        stdin=subprocess.PIPE, stdout=subprocess.PIPE)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.stdin.close()
        self.process.stdout.close()
        self.process.wait()

    def jod(self, test, reference, fps=0, block=0):
        as_list = lambda names: [os.path.abspath(n) for n in ([names] if isinstance(names, str) else names)]
        question = {"test": as_list(test), "reference": as_list(reference), "fps": fps, "block": block}
        try:
            self.process.stdin.write(json.dumps(question) + "\n")
            self.process.stdin.flush()
            answer = json.loads(self.process.stdout.readline() or "{}")
        except BrokenPipeError:
            answer = {}
        if "jod" not in answer:
            raise self.refused("ColorVideoVDP: %s" % answer.get("why", "it has died"))
        return (answer["jod"], answer["blocks"]) if block else answer["jod"]


# --- in that of build/judge ---

def read(name, numpy):
    if name.endswith(".npy"):
        return numpy.load(name).astype(numpy.float32)
    from PIL import Image
    with tempfile.TemporaryDirectory() as scratch:
        if name.endswith(".exr"):
            shown = os.path.join(scratch, "shown.png")
            subprocess.run(["oiiotool", name, "--ch", "R,G,B", "--clamp:min=0:max=1", "--colorconvert", "linear", "sRGB", "-d", "uint8",
                            "-o", shown], check=True, stdout=subprocess.DEVNULL)
            name = shown
        with Image.open(name) as picture:
            return numpy.asarray(picture.convert("RGB"), dtype=numpy.float32) / 255


def blocks_of(difference, block, numpy):
    """difference: [frames][height][width]"""
    square = (difference.astype(numpy.float64) ** 2).mean(axis=0)
    return [[float(square[y:y + block, x:x + block].mean() ** 0.5) for x in range(0, square.shape[1], block)]
            for y in range(0, square.shape[0], block)]


def answer(judges, numpy, test, reference, fps, block):
    if len(test) != len(reference) or not test:
        raise ValueError("%d pictures against %d" % (len(test), len(reference)))
    a, b = (numpy.stack([read(name, numpy) for name in names], axis=-1) for names in (test, reference))  # [H][W][C][F]
    if a.shape != b.shape:
        raise ValueError("%s has another size than %s" % (test[0], reference[0]))
    jod, more = judges[bool(block)].predict(a, b, dim_order="HWCF", frames_per_second=fps)
    return {"jod": float(jod), "blocks": blocks_of(more["heatmap"].numpy()[0, 0], block, numpy) if block else None}


def serve(ppd, peak):
    import numpy
    import pycvvdp
    photometry = pycvvdp.vvdp_display_photo_eotf(Y_peak=peak, contrast=CONTRAST, E_ambient=AMBIENT, EOTF="sRGB")
    geometry = pycvvdp.vvdp_display_geometry([3840, 2160], ppd=ppd)
    judges = [pycvvdp.cvvdp(display_photometry=photometry, display_geometry=geometry, heatmap=heatmap, quiet=True)
              for heatmap in (None, "raw")]
    for line in sys.stdin:
        try:
            response = answer(judges, numpy, **json.loads(line))
        except (OSError, ValueError, subprocess.CalledProcessError) as why:
            response = {"why": str(why)}
        print(json.dumps(response), flush=True)


def sensitivities():
    """The tables of ggn/sight/viewing.c, for a middle grey of 37 cd/m2: log2 of the sustained channel's, and of transient over it."""
    import numpy
    import pycvvdp
    name = os.path.join(os.path.dirname(pycvvdp.__file__), "vvdp_data", "csf_lut_weber_fixed_size.json")
    with open(name, encoding="utf-8") as file:
        table = json.load(file)
    log_rho, log_grey = numpy.log2(table["rho"]), numpy.log10(table["L_bkg"])

    def log_sensitivity(name):  # [luminance][rho], log10
        at_grey = [numpy.interp(numpy.log10(37), log_grey, of_rho) for of_rho in numpy.transpose(table[name])]
        return numpy.interp(numpy.arange(-3, 7), log_rho, at_grey)

    slow, fast = (log_sensitivity(name) * numpy.log2(10) for name in ("o0_c1", "o5_c1"))
    for row in (slow, fast - slow):
        print(", ".join("%.4f" % octaves for octaves in row))


if __name__ == "__main__":
    if sys.argv[1] == "--sensitivities":
        sensitivities()
    else:
        serve(float(sys.argv[1]), float(sys.argv[2]))
