#!/usr/bin/env python3
"""Tropism's vision beside OpenCV doing the same work: CPU time per photograph on one core, and the ratios.

    python3 benches/opencv/compare.py

Installs opencv-python-headless from PyPI into target/opencv-venv, builds the program `speed` in release, lets it draw
photographs of the virtual tent, and times both programs in turns on the same files. Each figure is the least of the
rounds: what a busy machine adds is not the program's. Decoding is part of the work on both sides. The floor is the time
in which our decoder reads the codes of a photograph and keeps nothing.
"""

import json
import os
import pathlib
import subprocess
import sys
import venv

ROOT = pathlib.Path(__file__).resolve().parents[2]
TARGET = pathlib.Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target"))
VENV = TARGET / "opencv-venv"
PHOTOS = TARGET / "opencv-photographs"
ROUNDS, PHOTOGRAPHS = 5, 8

# As the paper says (section 2.2.2), in the cheap order: grey decode, crop, blur, sample every fourth pixel, brightest.
# As the paper says (section 4): gates of eq. (10), median column of each row, ten points at equal distances.
OPENCV = r"""
import json, pathlib, sys, time
import cv2, numpy as np
cv2.setNumThreads(1)
photos = [path.read_bytes() for path in sorted(pathlib.Path(sys.argv[1]).glob("*.jpg"))]
x, y, w, h = json.loads(sys.argv[2])
step = int(sys.argv[3])
def grey(data):
    return cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_GRAYSCALE)
def tip(data):
    image = grey(data)[y : y + h, x : x + w]
    small = cv2.GaussianBlur(image, (0, 0), 0.5 * step)[step // 2 :: step, step // 2 :: step] if step > 1 else cv2.GaussianBlur(image, (0, 0), 0.5)
    low, high = np.median(small), np.partition(small, -20, None)[-20]
    rows = np.flatnonzero((small > low + 0.5 * (high - low)).any(1))
    return rows[0] if len(rows) else None
def stem(data):
    image = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR)[y : y + h, x : x + w]
    b, g, r = cv2.split(image)
    lightness = (cv2.max(cv2.max(b, g), r).astype(np.uint16) + cv2.min(cv2.min(b, g), r)) // 2
    mask = ((cv2.subtract(g, r) >= 128) & (cv2.subtract(g, b) >= 128)) | (g >= 192) | (lightness >= 192)
    points = [(np.median(np.flatnonzero(mask[row])), row) for row in np.flatnonzero(mask.any(1))]
    if len(points) < 2:
        return None
    line = np.array(points)
    along = np.concatenate([[0], np.cumsum(np.hypot(*np.diff(line, axis=0).T))])
    return [np.interp(np.linspace(0, along[-1], 10), along, line[:, axis]) for axis in (0, 1)]
def cost(work):
    start = time.process_time()
    for data in photos:
        work(data)
    return 1e3 * (time.process_time() - start) / len(photos)
for data in photos:
    tip(data), stem(data)
print(json.dumps({"decode grey": cost(grey), "paper tip": cost(tip), "paper stem": cost(stem), "version": cv2.__version__}))
"""


def run(*words, **more):
    return subprocess.run([str(word) for word in words], check=True, stdout=subprocess.PIPE, text=True, **more).stdout


def least(sheets):
    return {key: min(sheet[key] for sheet in sheets) for key in sheets[0] if key != "version"}


def main():
    python = VENV / "bin" / "python"
    if not python.exists():
        venv.create(VENV, with_pip=True)
        run(python, "-m", "pip", "install", "--quiet", "opencv-python-headless")
    run(
        "cargo", "build", "--release", "--quiet", "--manifest-path", "benches/Cargo.toml", "--target-dir", TARGET,
        "--bin", "speed", cwd=ROOT,
    )
    speed = TARGET / "release" / "speed"
    for width in (4608, 2592, 1000, 648):
        folder = PHOTOS / str(width)
        folder.mkdir(parents=True, exist_ok=True)
        crop = json.loads(run(speed, "draw", folder, width, PHOTOGRAPHS))
        ours, theirs = [], []
        for _ in range(ROUNDS):
            ours.append(json.loads(run(speed, "time", folder, width)))
            theirs.append(json.loads(run(python, "-c", OPENCV, folder, json.dumps(crop), width // 648)))
        version, ours, theirs = theirs[0]["version"], least(ours), least(theirs)
        print(f"\n{width} columns, ms of CPU time a photograph ({PHOTOGRAPHS} photographs, least of {ROUNDS} rounds)")
        for name, costs in ((f"OpenCV {version}", theirs), ("tropism", ours)):
            print(f"  {name:14}" + ", ".join(f"{key} {cost:.2f}" for key, cost in costs.items()))
        reference = theirs["paper tip"]
        print(f"  paper tip: OpenCV takes {reference / ours['paper tip']:.2f} times as long as tropism (wanted 4), which "
              f"takes {ours['paper tip'] / ours['floor']:.2f} times as long as the floor (wanted 1.3)")
        print(f"  robust tip and stem over OpenCV's paper tip: {ours['robust'] / reference:.2f} (wanted at most 1)")
        print(f"  photographs a second a core: paper {1e3 / ours['paper']:.0f}, robust {1e3 / ours['robust']:.0f}"
              + (" (wanted 400)" if width == 648 else ""))
    return 0


if __name__ == "__main__":
    sys.exit(main())
