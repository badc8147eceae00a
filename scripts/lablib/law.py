"""The model observer in numpy (ggn/sight/visibility.h, ggn/sight/remaining.h), for rules that are tried before they are built."""
import numpy as np

LUMINANCE = np.array([0.2126729, 0.7151522, 0.0721750], np.float32)
BLUR = np.array([0.009620057, 0.205423697, 0.569912492, 0.205423697, 0.009620057])
OFFSET, PATCH = 2.0, 100


def lightness(rgb):
    """L* of what a display sends for linear RGB [h, w, 3]."""
    y = np.clip(rgb, 0, 1) @ LUMINANCE
    return np.where(y > 216 / 24389, 116 * np.cbrt(y) - 16, y * (24389 / 27)).astype(np.float64)


def around(image, taps):
    """Separable sum over 5x5, edges repeated."""
    for axis in (0, 1):
        wide = np.pad(image, [(2, 2) if axis == a else (0, 0) for a in (0, 1)], mode="edge")
        n = image.shape[axis]
        image = sum(t * wide.take(range(k, k + n), axis) for k, t in enumerate(taps))
    return image


def patches(height, width):
    across, down = (-(-side // PATCH) for side in (width, height))
    for j in range(down):
        for i in range(across):
            yield slice(height * j // down, height * (j + 1) // down), slice(width * i // across, width * (i + 1) // across)


def texture(a, b):
    """The local deviation that two pictures share, [h, w]; its mean over a patch is that patch's."""
    flat = np.full(5, 0.2)
    covariance = around(a * b, flat) - around(a, flat) * around(b, flat)
    return np.sqrt(np.maximum(covariance - around(((a - b) / 2) ** 2, flat) / 5, 0))


def pooled(sixth, shared):
    """r from the sixth power of what is seen in each pixel."""
    seen = [np.cbrt(max(sixth[p].mean(), 0)) / (shared[p].mean() + OFFSET) for p in patches(*sixth.shape)]
    return float(np.sqrt(np.mean(seen)))


def noise(n, shared):
    return pooled(around(n, BLUR) ** 6, shared)


def expected(variance, shared):
    return pooled(15 * around(variance, BLUR ** 2) ** 3, shared)


def true(image, first, second, shared):
    """r of a picture against two independent references, whose own noise is taken out. All are L*."""
    g, h = around(image - first, BLUR), around(image - second, BLUR)
    m, d = (g + h) / 2, (g - h) / 2
    return pooled(m ** 6 - 15 * m ** 2 * d ** 2 * (m ** 2 - d ** 2) - d ** 6, shared)


def deviation(colour, moment2, spp):
    """L* of one standard deviation of each pixel's mean; two, halved, where one lies beyond white."""
    y = np.maximum(colour, 0).astype(np.float64) @ LUMINANCE
    share = np.sqrt(np.maximum(moment2 - y * y, 0) / max(spp - 1, 1)) / np.where(y > 0, y, 1)
    sides = [(lightness(colour * (1 + t * share)[..., None]) - lightness(colour * np.maximum(1 - t * share, 0)[..., None])) / (2 * t)
             for t in (1, 2)]
    return np.maximum(*sides)
