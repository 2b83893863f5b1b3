# SPDX-License-Identifier: Apache-2.0
"""Derivatives: forward and reverse, losses, the classic tutorial."""
import os

import importon as im
import numpy as np
from tap import SCENES, raises, run, spread, z

RED = "red.reflectance.value"


def box(res=16, **kw):
    return im.load_dict(im.cornell_box(res=res, **kw))


def test_forward_is_reverse():
    """<J dot, w> = <dot, J^T w> with the same walks"""
    s = box()
    rng = np.random.default_rng(1)
    w = rng.normal(size=(16, 16, 3)).astype(np.float32)
    g = im.render_backward(s, None, w, spp=16, seed=5)
    for name in g:
        dot = rng.normal(size=np.shape(g[name]))
        f = im.render_forward(s, None, {name: dot}, spp=16, seed=5)
        a, b = np.sum(np.asarray(f, float) * w), np.sum(g[name] * dot)
        assert abs(a - b) <= 2e-6 * np.sum(np.abs(np.asarray(f, float) * w)), (name, a, b)
        assert f.signed and f.se.shape == f.shape
    j = im.jacobian(s, RED, spp=16, seed=5)
    assert np.allclose(np.einsum("khwc,hwc->k", j[RED].astype(float), w), g[RED], rtol=1e-4, atol=1e-5)
    assert j.se[RED].shape == (3, 16, 16, 3) and len(j.pictures[RED]) == 3
    assert np.allclose(j.picture, im.render(s, spp=16, seed=5), rtol=1e-5, atol=1e-6)


def test_differences():
    """Gradients against differences of pictures with fresh random numbers"""
    s = box()
    p = im.traverse(s)
    w, said = np.ones((16, 16, 3)), []
    for name, h, most in (("light.emitter.radiance.value", 9, .08), ("white.reflectance.value", .1, .4)):
        g = im.render_backward(s, name, w, spp=512, seed=7)
        value, sums = p[name], {}
        for sign in (1, -1):
            p[name] = value + sign * h * np.array([0, 1, 0])
            many = [np.sum(im.render(s, spp=128, seed=100 * (1 + sign) + k), dtype=float) for k in range(9)]
            sums[sign] = np.mean(many), np.std(many, ddof=1) / 3
        p[name] = value
        d = (sums[1][0] - sums[-1][0]) / (2 * h)
        # Of the third derivative of the difference quotient: reflectance enters with powers.
        se = np.hypot(np.hypot(sums[1][1], sums[-1][1]) / (2 * h), g.se[name][1]) + (.01 * abs(d) if h < 1 else 0)
        said.append("z %.2f" % z(g[name][1], d, se, most_se=most * abs(d), what=name))
    return ", ".join(said)


def test_loss():
    """A loss without bias: value and gradient against their expectations, by many seeds"""
    s = box(res=8)
    target = im.render(s, spp=4096, seed=1)
    p = im.traverse(s)
    p.keep("red.*")
    p[RED] = p[RED] * .5 + .1
    many = [im.loss(s, target, p, spp=4, seed=10 + k, points="independent") for k in range(800)]
    n = len(many)
    mean = im.render(s, spp=4096, seed=3)
    truth = .5 * np.sum((np.asarray(mean, float) - target)**2) - .5 * np.sum(mean.se.astype(float)**2)
    values = np.array([float(e) for e in many])
    said = spread([e.se for e in many], values)
    z(values.mean(), truth, np.hypot(values.std(ddof=1) / n**.5, .02 * truth), what="value")
    g = np.array([e.grad[RED] for e in many])
    one = im.render_backward(s, p, np.asarray(mean) - np.asarray(target), spp=4096, seed=5)
    z(g.mean(axis=0), one[RED], np.hypot(g.std(axis=0, ddof=1) / n**.5, one.se[RED]), what="gradient")
    more = [spread([e.grad_se[RED][k] for e in many], g[:, k], most=1) for k in range(3)]
    assert many[0].bias_order == 0 and "+-" in repr(many[0]) and "<table>" in many[0]._repr_html_()
    return said + "; of the gradient " + ", ".join(m.split("variance ")[1] for m in more)


def test_is_the_command():
    """The same numbers as the command's `gradient --target`"""
    import json
    import subprocess
    path = os.path.join(SCENES, "cornell.xml")
    s = im.load_file(path, res=16)
    im.render(s, spp=64, seed=1).write("target.exr")
    p = im.traverse(s)
    p[RED] = .5
    for loss in ("l2", "relative", "log", "l1"):
        e = im.loss(s, "target.exr", RED, spp=8, seed=4, loss=loss)
        said = json.loads(subprocess.run(
            [os.path.join(os.environ["IMP_BUILD"], "cli", "importon"), "gradient", path, "-D", "res=16", "--set",
             RED + "=0.5,0.5,0.5", "-p", RED, "--target", "target.exr", "--spp", "8", "--seed", "4", "--loss", loss,
             "--json"], capture_output=True, text=True, check=True).stdout)
        numbers = [x for x in _numbers(said)]
        for value in [float(e), *e.grad[RED], *e.grad_se[RED]]:
            assert any(abs(x - value) <= 1e-9 * abs(value) for x in numbers), (loss, value, said)


def _numbers(x):
    if isinstance(x, dict):
        for v in x.values():
            yield from _numbers(v)
    elif isinstance(x, list):
        for v in x:
            yield from _numbers(v)
    elif isinstance(x, (int, float)):
        yield x


def test_targets():
    """Targets of all kinds; bad ones are named"""
    s = box()
    t = im.render(s, spp=4, seed=1)
    t.write("t.exr")
    values = {float(im.loss(s, x, RED, spp=4)) for x in
              (t, "t.exr", np.asarray(t), [t], {0: t}, t.astype(np.float64), np.asfortranarray(t), np.asarray(t).tolist())}
    assert len(values) == 1, values
    w = np.zeros((16, 16))
    w[:8] = 1
    assert float(im.loss(s, t, RED, spp=4, weights=w)) not in values
    raises(im.ArgumentError, lambda: im.loss(s, t[:8], RED, spp=4), "16")
    raises(im.ArgumentError, lambda: im.loss(s, np.full((16, 16, 3), np.nan), RED, spp=4), "finite")
    raises(im.ArgumentError, lambda: im.loss(s, t, RED, weights=-w), "weight")
    raises(im.ArgumentError, lambda: im.loss(s, t, RED, weights=w[:4]), "weights")
    raises(im.ArgumentError, lambda: im.loss(s, [t, t], RED), "2 targets")
    raises(im.ArgumentError, lambda: im.loss(s, t, RED, loss="l3"), "l3", "l2")
    assert not len(im.loss(s, t, [], spp=4).grad)
    raises(TypeError, lambda: im.loss(s, t, 3), "params")
    raises(im.ArgumentError, lambda: im.loss(s, t, im.traverse(box())), "another scene")
    raises(im.ArgumentError, lambda: im.loss(s, t, "blue.*"), "blue")
    assert float(im.loss(s, t, RED, spp=4, tikhonov={"red.*": 100})) > max(values)


def test_bias_is_refused():
    """A parameter without an unbiased gradient is refused by name, a pattern leaves it out"""
    d = im.cornell_box(res=16)
    d["small-box"] = {"type": "sphere", "radius": .3, "center": [.3, -.6, .3],
                      "bsdf": {"type": "dielectric", "id": "glass", "int_ior": 1.5}}
    s = im.load_dict(d)
    p = im.traverse(s)
    name = "glass.eta.value"
    assert name in p and not p.info(name).differentiable, list(p)
    t = im.render(s, spp=2)
    raises(im.BiasError, lambda: im.loss(s, t, name, spp=2), name)
    p.keep([name, "red.*"])
    raises(im.BiasError, lambda: im.loss(s, t, p, spp=2), name)
    q = im.traverse(s)
    assert name not in im.loss(s, t, q, spp=2).grad


def test_adjoint_images():
    """Adjoint images and directions: shapes, kinds and finite numbers"""
    s = box()
    for bad in (np.zeros((16, 16)), np.zeros((8, 16, 3)), np.full((16, 16, 3), np.inf), np.zeros((16, 16, 3), complex), None, "x"):
        raises(im.ArgumentError, lambda: im.render_backward(s, RED, bad, spp=2))
    for bad in ({RED: [1, 2]}, {"white.reflectance.value": 1}, {"blue": 1}, {RED: np.nan}, [1, 2], {RED: "x"}):
        raises(im.ArgumentError, lambda: im.render_forward(s, RED, bad, spp=2))
    assert im.render_forward(s, RED, [1, 0, 0], spp=2).shape == (16, 16, 3)
    raises(im.ArgumentError, lambda: im.jacobian(im.load_file(os.path.join(SCENES, "textured.xml")), spp=2), "256")


def test_check():
    """check passes, and a row says so"""
    s = box()
    c = im.check(s, RED, spp=16, paths=100, draws_time=0.1)
    assert c and c.ok and not c.failed and len(c) == len(list(c)) and {r.method for r in c} >= {"frozen", "dot", "fresh"}
    assert "<table>" in c._repr_html_() and "ok" in repr(next(r for r in c if r.method == "frozen"))
    assert im.check(s, RED, im.render(s, spp=4, seed=9), spp=16, paths=20, draws_time=0.1)


TUTORIAL = '''
import drjit as dr
import mitsuba as mi
mi.set_variant('llvm_ad_rgb')
scene = mi.load_file('cbox.xml', res=32)
image_ref = mi.render(scene, spp=512)
params = mi.traverse(scene)
key = 'red.reflectance.value'
param_ref = mi.Color3f(params[key])
params[key] = mi.Color3f(0.01, 0.2, 0.9)
params.update()
image_init = mi.render(scene, spp=128)
opt = mi.ad.Adam(lr=0.05)
opt[key] = params[key]
params.update(opt)
def mse(image):
    return dr.mean(dr.square(image - image_ref))
iteration_count = 50
errors = []
for it in range(iteration_count):
    image = mi.render(scene, params, spp=4)
    loss = mse(image)
    dr.backward(loss)
    opt.step()
    opt[key] = dr.clip(opt[key], 0.0, 1.0)
    params.update(opt)
    err_ref = dr.sum(dr.square(param_ref - params[key]))
    errors.append(err_ref)
'''
CHANGES = {"import drjit as dr": "import numpy as dr", "import mitsuba as mi": "import importon as mi",
           "    dr.backward(loss)": "    gradient = mi.loss(scene, image_ref, params, spp=4, seed=it)",
           "    opt.step()": "    opt.step(gradient)"}


def test_tutorial():
    """The classic tutorial, 50 Adam steps on a red wall, with four changed lines"""
    with open("cbox.xml", "w") as f:
        text = open(os.path.join(SCENES, "cornell.xml")).read()
        f.write(text.replace('value="cornell/', 'value="%s/cornell/' % SCENES))
    lines = [CHANGES.get(line, line) for line in TUTORIAL.splitlines()]
    assert sum(a != b for a, b in zip(lines, TUTORIAL.splitlines())) == len(CHANGES) <= 5
    space = {}
    exec("\n".join(lines), space)
    assert space["errors"][0] > .5 and space["errors"][-1] < .01, (space["errors"][0], space["errors"][-1])
    return "error %.3g to %.2g" % (space["errors"][0], space["errors"][-1])


run(globals())
