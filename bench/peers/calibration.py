#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""A camera from one photograph of three boards: importon's fit beside OpenCV's calibrateCamera.

    calibration.py [--cases N] [--width W] [--spp S] [--noise SIGMA] [--fit-spp S] [--opencv-only]

Both get the same photograph of scenes/board.xml, W x 3W/4 pixels with S walks a pixel and Gaussian
noise of SIGMA of its largest value, and the same rough guess, the scene as the file has it. OpenCV
(`pip install opencv-python-headless`) gets the 75 inner corners of the boards, found by
cornerSubPix from where they truly are, which is the best that a detector can give; importon gets
pixels. Prints the errors of the field of view, the principal point, k1 and the place, in units of
the truth, what each says of its error, and processor seconds."""
import argparse
import json
import math
import os
import random
import resource
import subprocess
import tempfile

import needed

cv2, np = needed.modules("cv2", "numpy")

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
SCENE = os.path.join(ROOT, "scenes", "board.xml")
EYE, AT = np.array([4.6, 3.4, 3.2]), np.array([0.6, 0.75, 0.7])
NAMES = ["x_fov", "principal_point_offset_x", "principal_point_offset_y", "opencv_k1", "opencv_k2"]


def spent():
    own = resource.getrusage(resource.RUSAGE_CHILDREN)
    return own.ru_utime + own.ru_stime


def importon(*words):
    return subprocess.run(["importon", *words], check=True, capture_output=True, text=True).stdout


def rotation(a):
    return cv2.Rodrigues(np.asarray(a, float))[0]


def camera_at(pose):
    """Rotation of the world to x right, y down, z ahead, and the place of the camera."""
    z = (AT - EYE) / np.linalg.norm(AT - EYE)
    x = np.cross(z, [0, 0, 1.0])
    x /= np.linalg.norm(x)
    turn = np.stack([x, np.cross(z, x), z])
    return turn @ rotation(pose[3:]).T, EYE + np.asarray(pose[:3])


def intrinsics(v, w, h):
    f = w / 2 / math.tan(math.radians(v[0]) / 2)
    return np.array([[f, 0, w * (0.5 - v[1]) - 0.5], [0, f, h * (0.5 - v[2]) - 0.5], [0, 0, 1.0]])


def corners():
    rim, side, off = 0.1, 0.3, 0.004
    out = []
    for axis in range(3):
        for i in range(1, 6):
            for j in range(1, 6):
                p = [0.0] * 3
                p[axis], p[(axis + 1) % 3], p[(axis + 2) % 3] = off, rim + i * side, rim + j * side
                out.append(p)
    return np.array(out, np.float32)


def by_opencv(image, pose, view, w, h):
    """The eleven numbers with their standard deviations (NaN where it gives none)."""
    turn, place = camera_at(pose)
    lens = np.array([view[3], view[4], 0, 0, 0])
    points = corners()
    start, _ = cv2.projectPoints(points, cv2.Rodrigues(turn)[0], -turn @ place, intrinsics(view, w, h), lens)
    grey = np.clip(255 * image / image.max(), 0, 255).astype(np.uint8)
    small = max(2, w // 80)
    at = start.reshape(-1, 2)
    inside = (at > small + 2).all(1) & (at < [w - small - 3, h - small - 3]).all(1)
    points, start = points[inside], start[inside]
    found = cv2.cornerSubPix(grey, start.astype(np.float32), (small, small), (-1, -1),
                             (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_COUNT, 60, 1e-4))
    flags = cv2.CALIB_USE_INTRINSIC_GUESS | cv2.CALIB_FIX_ASPECT_RATIO | cv2.CALIB_ZERO_TANGENT_DIST | cv2.CALIB_FIX_K3
    out = cv2.calibrateCameraExtended([points], [found], (w, h), intrinsics([40, 0, 0], w, h), np.zeros(5), flags=flags)
    K, k, r, t, sd = out[1], out[2].ravel(), out[3][0], out[4][0], out[5].ravel()
    f = K[0, 0]
    R = cv2.Rodrigues(r)[0]
    value = [math.degrees(2 * math.atan(w / 2 / f)), 0.5 - (K[0, 2] + 0.5) / w, 0.5 - (K[1, 2] + 0.5) / h, k[0], k[1]]
    slope = math.degrees(w / (f * f + w * w / 4))
    return value, [max(sd[0], sd[1]) * slope, sd[2] / w, sd[3] / h, sd[4], sd[5]], (-R.T @ t).ravel()


def by_importon(folder, w, h, spp):
    names = ["camera.pose"] + ["camera." + n for n in NAMES]
    words = [word for n in names for word in ("-p", n)]
    out = importon("fit", SCENE, "-D", f"width={w}", "-D", f"height={h}", "-T", f"{folder}/photo.npy", "--spp", str(spp), *words,
                   "--optimizer", "lm", "--levels", "3", "-o", f"{folder}/found", "--overwrite", "--json", "-q")
    numbers = {p["name"]: p for p in json.loads(out)["params"]}
    value = [numbers["camera." + n]["value"] for n in NAMES]
    error = [numbers["camera." + n]["se"] for n in NAMES]
    return value, error, EYE + np.array([numbers[f"camera.pose[{k}]"]["value"] for k in range(3)])


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    for name, value in (("cases", 3), ("width", 128), ("spp", 64), ("fit_spp", 16)):
        parser.add_argument("--" + name.replace("_", "-"), type=int, default=value)
    parser.add_argument("--noise", type=float, default=0.01)
    parser.add_argument("--opencv-only", action="store_true")
    o = parser.parse_args()
    w, h = o.width, o.width * 3 // 4
    rng = random.Random(1)
    errors = {"opencv": []} if o.opencv_only else {"opencv": [], "importon": []}
    times = {"opencv": 0.0, "importon": 0.0}
    for case in range(o.cases):
        pose = [rng.uniform(-0.15, 0.15) for _ in range(3)] + [rng.uniform(-0.03, 0.03) for _ in range(3)]
        view = [rng.uniform(37, 43), rng.uniform(-0.015, 0.015), rng.uniform(-0.015, 0.015), rng.uniform(-0.25, 0.1), 0.05]
        with tempfile.TemporaryDirectory() as folder:
            sets = ["--set", "camera.pose=" + ",".join(map(str, pose))]
            for n, v in zip(NAMES, view):
                sets += ["--set", f"camera.{n}={v}"]
            importon("render", SCENE, "-D", f"width={w}", "-D", f"height={h}", *sets, "--spp", str(o.spp), "--seed", str(50 + case),
                     "-o", f"{folder}/photo.npy", "-q", "--no-preview")
            image = np.load(f"{folder}/photo.npy")
            image = image + np.random.default_rng(case).normal(0, o.noise * image.max(), image.shape).astype(np.float32)
            np.save(f"{folder}/photo.npy", image.astype(np.float32))
            for name in errors:
                before = spent() if name == "importon" else os.times()[0]
                got = by_opencv(image.mean(2), pose, view, w, h) if name == "opencv" else by_importon(folder, w, h, o.fit_spp)
                times[name] += (spent() if name == "importon" else os.times()[0]) - before
                place = np.linalg.norm(got[2] - (EYE + np.array(pose[:3])))
                errors[name].append([g - v for g, v in zip(got[0], view)] + [place] + list(got[1]))
    print(f"{o.cases} photographs of {w} x {h}, noise {o.noise:g}; rms error, and in brackets what is said (rms)")
    for name, rows in errors.items():
        e = np.sqrt(np.mean(np.square(rows), 0))
        print(f"{name:9s} " + ", ".join(f"{n} {e[k]:.4f} ({e[6 + k]:.4f})" for k, n in enumerate(NAMES)) +
              f", place {e[5]:.4f}; {times[name] / o.cases:.2f} s a photograph")


if __name__ == "__main__":
    main()
