# SPDX-License-Identifier: Apache-2.0
"""The sky that Mitsuba's spectral variants see in an environment map, as a picture.

    python3 bench/peers/sky_product.py IN OUT [FINER]

Between the texels of an `envmap` Mitsuba interpolates the spectra S and the scales m of the texels apart, and multiplies:
(sum w S)(sum w m), where the colour between the texels is sum w m S. OUT has FINER (odd, 5) times as many texels as IN, and in each the
colour in daylight of that product, with Mitsuba's own S. Printed: how much that is of the colour between the texels, the whole sky's mean.
A scene with OUT for its map is for importon what the one with IN is for Mitsuba.
"""
import sys

from zcompare import mi, np

NM = np.arange(360, 831, 5.)
TO_RGB = np.array([[3.240479, -1.537150, -.498535], [-.969256, 1.875991, .041556], [.055648, -.204043, 1.057311]])


def spectra(texels):
    """S[y][x][wavelength] and m[y][x]."""
    m = 2 * texels.max(-1)
    colors = (texels / np.maximum(1e-8, m)[..., None]).reshape(-1, 3)
    c = np.array([list(mi.srgb_model_fetch([float(v) for v in k])) for k in colors]).reshape(*m.shape, 3, 1)
    v = (c[..., 0, :] * NM + c[..., 1, :]) * NM + c[..., 2, :]
    flat = np.isinf(c[..., 2, :])  # black and white
    with np.errstate(invalid="ignore"):
        s = np.where(flat, c[..., 2, :] > 0, .5 + .5 * v / np.sqrt(1 + v * v))
    return s.astype(np.float32), m


def color_response():
    mi.set_variant("llvm_ad_spectral")
    nm = mi.Float(NM)
    r = TO_RGB @ (np.array(mi.cie1931_xyz(nm)) * np.array(mi.cie_d65(nm)))
    return (r / r.sum(1, keepdims=True)).astype(np.float32).T


def main():
    mi.set_variant("scalar_spectral")
    bitmap = mi.Bitmap(sys.argv[1]).convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.Float32, False)
    texels, finer = np.array(bitmap, dtype=float), int(sys.argv[3]) if len(sys.argv) > 3 else 5
    h, w, _ = texels.shape
    s, m = spectra(texels)
    response = color_response()
    # Rows lie on both poles, columns in the middles of theirs.
    x = (np.arange(w * finer) + .5) / finer - .5
    a, b, t = np.floor(x).astype(int) % w, (np.floor(x).astype(int) + 1) % w, (x - np.floor(x)).astype(np.float32)[:, None]
    rows = finer * (h - 1) + 1
    product, plain = np.empty((2, rows, w * finer, 3), np.float32)
    for k in range(rows):
        y = min(k // finer, h - 2)
        u = np.float32(k / finer - y)
        def between(of):
            row = (1 - u) * of[y] + u * of[y + 1]
            return (1 - t) * row[a] + t * row[b]
        product[k] = between(s) @ response * between(m[..., None])
        plain[k] = between(texels)
    solid = np.sin(np.pi * np.arange(rows) / (rows - 1))[:, None, None]
    print("product / colour between texels: %.5f %.5f %.5f" % tuple((product * solid).sum((0, 1)) / (plain * solid).sum((0, 1))))
    mi.Bitmap(np.maximum(product, 0)).write(sys.argv[2])


if __name__ == "__main__":
    main()
