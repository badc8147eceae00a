"""Mean over the block of |I - A| / sqrt(I), I all samples and A half of them (Dammertz et al. 2010): the stops of halfbuf.c."""
import numpy as np

requires = ["color", "half"]
first_spp = 16
parameters = {"threshold": 0.004}


def check(block):
    spp, frame, threshold = block.spp, block.frame, parameters["threshold"]
    split = np.sqrt(block.half_spp / (spp - block.half_spp))  # 1 where A has half of the samples
    difference, total = np.abs(block.color - block.half).sum(axis=2), np.abs(block.color.sum(axis=2))
    e = split * np.sqrt(frame.exposure) * difference / np.sqrt(np.maximum(total, 1e-3 * difference))
    good = np.isfinite(difference + total)
    error = np.sqrt(e.size / (frame.width * frame.height)) * np.where(difference == 0, 0, e)[good].mean()
    y, y_half = (frame.exposure * plane @ frame.rgb_to_xyz[1] for plane in (block.color, block.half))
    if (split * np.abs(y - y_half) > 0.5 * np.maximum(np.abs(y), 0.02))[good].any():
        return 1.5 * spp, error  # a pixel hangs on one sample: nobody knows for how long
    if error <= threshold:
        return True, error, spp
    predicted = spp * (error / threshold) ** 2
    return np.clip(predicted, 1.1 * spp, 1.5 * spp), error, predicted
