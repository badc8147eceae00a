"""What other judges say of the pictures of `lab denoised`: ColorVideoVDP (lablib/cvvdp.py) and FLIP beside the model observer.

Each judge has units of its own. What is common are the noisy pictures: of a denoised one is asked how strong noise, in units of the
observer, a judge finds as bad, and that is divided by what the observer says of the denoised picture. Above 1 the judge is the stricter
one about what denoising leaves. All of them see the same reference, the mean of two."""
import json
import math
import os
import statistics

from lablib import cvvdp, tool

LOOKS = (64, 160, 320, 640)
KINDS = ("noisy", "denoised", "blend")
JUDGES = ("cvvdp", "flip")


def opinions(folder, mean, block):
    """Of the pictures in the folder; mean: the reference."""
    out = []
    with cvvdp.Judge() as judge:
        for spp in LOOKS:
            for kind in KINDS:
                picture = os.path.join(folder, "%d-%s.png" % (spp, kind))
                seen = json.loads(tool.ggn("visible", mean, picture, "--block", block, "--json"))["blocks"]
                out.append({"spp": spp, "kind": kind, "observer": statistics.mean(b["error"] ** 2 for b in seen) ** 0.5,
                            "cvvdp": 10 - judge.jod(picture, mean),
                            "flip": json.loads(tool.ggn("flip", mean, picture, "--json"))["mean"]})
    return out


def ratios(opinions, judge, kind):
    """At every look: noise that the judge finds as bad over what the observer says, from one scene's opinions."""
    line = statistics.linear_regression([math.log(x[judge]) for x in opinions if x["kind"] == "noisy"],
                                        [math.log(x["observer"]) for x in opinions if x["kind"] == "noisy"])
    return [math.exp(line.intercept + line.slope * math.log(x[judge])) / x["observer"] for x in opinions if x["kind"] == kind]


def summary(scenes):
    """scenes: opinions of each. Medians over scenes and looks."""
    return {"scenes": len(scenes), **{"%s_%s" % (judge, kind): statistics.median(r for opinions in scenes for r in ratios(opinions, judge, kind))
                                      for judge in JUDGES for kind in KINDS[1:]}}


def text(s):
    return ("what denoising leaves, as noise that a judge finds as bad, over what the observer says of it (%d scenes at %s samples, median; "
            "above 1 the judge is stricter): ColorVideoVDP **%.2f** of the denoised picture and **%.2f** of the blend, FLIP **%.2f** and "
            "**%.2f**" % (s["scenes"], ", ".join(map(str, LOOKS)), s["cvvdp_denoised"], s["cvvdp_blend"], s["flip_denoised"], s["flip_blend"]))
