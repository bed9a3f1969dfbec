#!/usr/bin/env python3
"""Writes crates/sparing-image/tests/data/flip.txt: FLIP of small pictures made by formulas, by the reference implementation of the
method's authors (the package flip-evaluator), and their relMSE in exact fractions. The cases `flip-reference` and `relmse-exact` of
`sparing stress` make the same pictures and compare.

    python3 -m venv venv && venv/bin/pip install flip-evaluator==1.7 numpy
    venv/bin/python scripts/flip-values.py > crates/sparing-image/tests/data/flip.txt
"""

from fractions import Fraction
from importlib.metadata import version

import flip_evaluator
import numpy

WIDTH, HEIGHT = 64, 48
# Pixels whose values are kept, x and y.
PIXELS = [(0, 0), (63, 0), (5, 3), (20, 7), (31, 23), (32, 24), (33, 25), (40, 11), (50, 30), (9, 40), (0, 47), (63, 47)]
EPSILON = Fraction(1, 100)


def noise(x, y, channel, seed):
    """0..1023, the same on every machine."""
    h = (x * 73856093 + y * 19349663 + channel * 83492791 + seed * 2654435761) % 2**32
    h ^= h >> 15
    h = h * 2246822519 % 2**32
    h ^= h >> 13
    h = h * 3266489917 % 2**32
    h ^= h >> 16
    return h % 1024


def gradient(x, y, c):
    return [x * 16, y * 21, (x + y) * 9][c]


def pair(name, x, y, c):
    """Picture and reference at a channel, in units of 1/1024."""
    smooth = gradient(x, y, c)
    if name == "gradient-noise":
        return min(max(smooth + noise(x, y, c, 1) // 8 - 64, 0), 1023), smooth
    if name == "gradient-speckle":
        return (1023 if noise(x, y, 0, 2) < 20 else smooth), smooth
    if name == "edge-shifted":
        return (900 if x + y // 2 < 41 else 100), (900 if x + y // 2 < 40 else 100)
    if name == "blocks":
        return noise(x // 8, y // 8, c, 3), noise(x // 8, y // 8, c, 4)
    if name == "blocks-tinted":
        value = noise(x // 8, y // 8, c, 3)
        return (value * 7 // 8 if c == 2 else value), value
    if name == "points":
        return (1023 if x % 7 == 3 and y % 5 == 2 else 30), 30
    if name == "dark":
        return noise(x, y, c, 5) // 64, noise(x, y, c, 6) // 64
    if name == "opposite":
        return ([0, 1023, 0][c], [0, 0, 1023][c])
    raise ValueError(name)


NAMES = ["gradient-noise", "gradient-speckle", "edge-shifted", "blocks", "blocks-tinted", "points", "dark", "opposite"]


def main():
    print(f"# LDR-FLIP by flip-evaluator {version('flip-evaluator')} (scripts/flip-values.py), pictures of {WIDTH}x{HEIGHT};")
    print("# relMSE in exact fractions. name, mean of FLIP, relMSE, FLIP of single pixels: " + " ".join(f"{x},{y}" for x, y in PIXELS))
    for name in NAMES:
        values = [[[pair(name, x, y, c) for c in range(3)] for x in range(WIDTH)] for y in range(HEIGHT)]
        pictures = [
            numpy.array([[[v[k] for v in pixel] for pixel in row] for row in values], dtype=numpy.float32) / 1024 for k in (0, 1)
        ]
        # The first argument is the reference.
        flip, mean, _ = flip_evaluator.evaluate(pictures[1], pictures[0], "LDR", inputsRGB=False, applyMagma=False)
        flip = numpy.asarray(flip).reshape(HEIGHT, WIDTH)
        total = Fraction(0)
        for row in values:
            for pixel in row:
                for image, reference in pixel:
                    i, r = Fraction(image, 1024), Fraction(reference, 1024)
                    total += (i - r) ** 2 / (r * r + EPSILON)
        relative = float(total / (3 * WIDTH * HEIGHT))
        print(name, f"{mean:.7f}", f"{relative:.15e}", *(f"{flip[y][x]:.6f}" for x, y in PIXELS))


main()
