# SPDX-License-Identifier: Apache-2.0
"""Random calls with random arguments, good and bad, on objects in any state: an exception or a
result, never a crash. In a build with the address sanitizer, run with its runtime preloaded."""
import gc
import os
import random
import warnings

import importon as im
import numpy as np
from tap import SCENES, run

RED = "red.reflectance.value"
BEND = os.path.join(SCENES, "bend", "rod.xml")


class Odd:
    """Answers to everything, and is nothing."""

    def __array__(self, *a, **k):
        raise ValueError("no array")

    def __index__(self):
        return -2**70

    def __float__(self):
        return float("nan")

    def __fspath__(self):
        return "x\0y"


def values(rng):
    """Arguments of every kind."""
    a = np.random.default_rng(rng.randrange(2**32))
    return rng.choice([
        lambda: None, lambda: 0, lambda: -1, lambda: 1, lambda: 2**31, lambda: 2**64, lambda: 1e300, lambda: float("nan"),
        lambda: float("inf"), lambda: "", lambda: RED, lambda: "red.*", lambda: "*", lambda: "l2", lambda: "x" * 5000,
        lambda: "a\0b", lambda: b"\xff\xfe", lambda: [], lambda: {}, lambda: {RED: 1}, lambda: {RED: [0, 1]},
        lambda: {"type": "scene"}, lambda: {"type": "sphere"}, lambda: Odd(), lambda: object(), lambda: True, lambda: 1j,
        lambda: a.random((8, 8, 3)), lambda: a.random((8, 8, 3)).astype(np.float32)[::-1, ::2], lambda: a.random((8, 8)),
        lambda: np.full((8, 8, 3), np.nan), lambda: np.zeros((0, 3)), lambda: np.zeros((8, 8, 3), complex),
        lambda: np.zeros(3), lambda: a.random((5, 3)), lambda: np.zeros((2,) * 20), lambda: np.array([object()] * 3),
        lambda: np.lib.stride_tricks.as_strided(np.zeros(1), (8, 8, 3), (0, 0, 0)), lambda: np.float16(0.5),
        lambda: memoryview(bytes(range(24))), lambda: np.zeros(3, dtype=">f8"), lambda: im.Transform4f(),
        lambda: (x for x in range(3)), lambda: "none/none.xml", lambda: "/dev/null", lambda: "/", lambda: 3,
        lambda: [a.random((8, 8, 3))] * 2, lambda: {0: a.random((8, 8, 3))}, lambda: np.arange(3)])()


class World:
    def __init__(self, seed):
        self.rng = random.Random(seed)
        self.kept, self.parts = [], []
        self.scenes = [im.load_dict(im.cornell_box(res=8, spp=2))]

    def pick(self, *kinds):
        """Mostly something of these kinds that is there, else anything."""
        found = [k for k in self.kept + self.scenes if isinstance(k, kinds)]
        return self.rng.choice(found) if found and self.rng.random() < .85 else values(self.rng)

    def maybe(self, good):
        return good if self.rng.random() < .6 else values(self.rng)

    def team(self, rank, ranks, gather):
        with im.team(rank, ranks, gather):
            return im.render(im.load_dict(im.cornell_box(res=8)), spp=1)

    def step(self):
        r, scene = self.rng, self.pick(im.Scene)
        params = self.maybe(self.pick(im.SceneParameters) if r.random() < .3 else r.choice([None, RED, "red.*", [RED]]))
        picture = self.pick(im.Picture, np.ndarray)
        spp = self.maybe(r.choice([1, 2, 3]))
        target = self.maybe(r.choice([np.full((8, 8, 3), .2), "a.exr"]))
        rays = r.choice([5, 1, 0])
        o, d = self.maybe(np.tile([0, 0, .1], (rays, 1))), self.maybe(np.tile([0, .1, 1.], (rays, 1)))
        field, bend, elements = self.pick(im.bend.Field), self.pick(im.bend.Bend), self.pick(im.elements.Elements)
        handed = self.pick(im.SceneParameters)
        calls = [
            lambda: self.scenes.append(im.load_dict(im.cornell_box(res=8, spp=2))) if len(self.scenes) < 4 else None,
            lambda: im.load_dict(self.maybe({"type": "scene", "a": values(r), "b": {"type": self.maybe("sphere"), "radius": values(r)}})),
            lambda: im.load_string(self.maybe("<scene version='3.0.0'/>"), mode=self.maybe("rgb")),
            lambda: im.load_file(values(r)), lambda: scene.close() if r.random() < .15 else None,
            lambda: im.traverse(scene), lambda: handed[values(r)], lambda: handed.__setitem__(self.maybe(RED), values(r)),
            lambda: handed.keep(values(r)), lambda: handed.update(values(r)), lambda: repr(handed),
            lambda: im.render(scene, self.maybe(None), sensor=self.maybe(0), spp=spp, seed=self.maybe(3)),
            lambda: im.render(scene, spp=2, progress=self.maybe(lambda p: r.choice([True, None, im.render(scene)]))),
            lambda: im.render(scene, spp=2, guide=self.pick(im.elements.Guide)),
            lambda: im.loss(scene, target, params, spp=spp, loss=self.maybe("l2"), weights=self.maybe(None)),
            lambda: im.loss(scene, target, params, spp=2, tikhonov=values(r), stay=self.maybe(None)),
            lambda: im.render_forward(scene, params, self.maybe({RED: 1}), spp=spp),
            lambda: im.render_backward(scene, params, self.maybe(np.ones((8, 8, 3))), spp=spp),
            lambda: im.jacobian(scene, params, spp=spp),
            lambda: im.fit(scene, target, params, max_iterations=self.maybe(2), spp=2, optimizer=self.maybe("adam"),
                           intervals=self.maybe(False), checkpoint=self.maybe(None)),
            lambda: im.check(scene, params, spp=2, paths=5, fresh_spp=2, draws_time=0.01),
            lambda: im.compare(picture, self.maybe(picture)), lambda: im.write(self.maybe("a.exr"), picture),
            lambda: im.read(self.maybe("a.exr")), lambda: picture[values(r)], lambda: picture + values(r),
            lambda: picture._repr_html_(), lambda: picture.__reduce__(),
            lambda: im.bend.Field.grid(self.maybe([3, 3, 3]), self.maybe([-1] * 3), self.maybe([1] * 3), self.maybe(1.4)),
            lambda: im.bend.Field.profile(self.maybe("rod"), values(r)), lambda: setattr(field, "theta", self.maybe(field.theta)),
            lambda: im.bend.trace(field, o, d, step=self.maybe(.1), max_steps=self.maybe(200)),
            lambda: im.bend.adjoint(field, o, d, self.maybe(im.bend.trace(field, o, d, step=.1)), self.maybe(None), step=.1),
            lambda: im.bend.tangent(field, o, d, values(r), values(r), step=.1), lambda: field.eval(self.maybe([[0, 0, 0]])),
            lambda: im.bend.load_file(BEND, count=self.maybe(8)), lambda: im.bend.Bend(field), lambda: bend.objective(),
            lambda: bend.add_rays(o, d, self.maybe(None)), lambda: bend.add_target(self.maybe("focus"), data=values(r)),
            lambda: bend.fit(iterations=self.maybe(2)), lambda: bend.close() if r.random() < .2 else bend.field,
            lambda: bend.ray(self.maybe(0)), lambda: bend.image(self.maybe(0)),
            lambda: im.elements.Elements(scene, self.maybe([]), stop=self.maybe(.5), max_level=self.maybe(2)),
            lambda: elements.image(self.maybe(0), self.maybe("flat")), lambda: elements.sensitivity(),
            lambda: elements.fit(self.maybe([1.0]), params, max_iterations=2), lambda: im.guide(elements, share=self.maybe(.2)),
            lambda: im.functional(scene, params, self.maybe(None), spp=spp), lambda: im.walk(scene, self.maybe(1), self.maybe(2), json=True),
            lambda: im.selftest(scene, self.maybe("camera"), samples=self.maybe(1000), directions=1),
            lambda: im.check(scene, params, sampling=True, spp=2), lambda: im.render(scene, spp=2, wavelengths=self.maybe("independent")),
            lambda: im.project(picture, self.maybe("latlong"), self.maybe("equal_area"), width=self.maybe(4)),
            lambda: im.reduce(picture, self.maybe(4), self.maybe(2), white=self.maybe(.5)),
            lambda: im.jacobian(scene, RED, spp=1).sums(self.maybe(None)), lambda: picture.attribute(values(r)),
            lambda: im.write("a.exr", picture, attributes=self.maybe({"a": "b"})),
            lambda: im.report(self.maybe("r.html"), [self.maybe(picture), {"json": values(r)}]),
            lambda: self.parts.append(im.part(lambda: im.render(im.load_dict(im.cornell_box(res=8)), spp=2), self.maybe(1), self.maybe(2))),
            lambda: im.merge(lambda: im.render(im.load_dict(im.cornell_box(res=8)), spp=2), self.maybe(self.parts[-2:])),
            lambda: im.parts_info(self.maybe(self.parts[-2:])), lambda: self.team(self.maybe(0), self.maybe(1), self.maybe(lambda m: [m])),
            lambda: im.bend.Field.sum([field, self.pick(im.bend.Field)]), lambda: im.bend.Field.scaled(field, self.maybe(1.1)),
            lambda: im.bend.Field.tied(field, mirror=self.maybe((1, 1, 0)), fold=self.maybe(0)),
            lambda: im.bend.Field.rz(self.maybe(1.5), radius=self.maybe(1.0), cells_r=self.maybe(2), cells_z=self.maybe(3)),
            lambda: field.eval(self.maybe([[0, 0, 0]]), hessian=True), lambda: field.eval_adjoint(self.maybe([[0, 0, 0]]), self.maybe([1.]), values(r)),
            lambda: field.eval_tangent([[0, 0, 0]], values(r)), lambda: field.set_samples(values(r)), lambda: field.samples_adjoint(values(r)),
            lambda: field.refined_adjoint(values(r)), lambda: field.names, lambda: field.grid_info,
            lambda: im.bend.trace(field, o, d, taps=self.maybe([{"offset": .3}]), groups=self.maybe(None), step=.1),
            lambda: im.bend.path(field, o, d, self.maybe(0), step=.1), lambda: bend.hold_number(self.maybe(0), self.maybe(1.3)),
            lambda: bend.hold_rim(self.maybe(1)), lambda: bend.hold_outside(self.maybe([0, 0, 0]), self.maybe(1.0)),
            lambda: bend.set_wavelength(self.maybe(0), self.maybe({"coefficient": [1.5, .01, 0, 0, 0, 0]}), self.maybe(.5)),
            lambda: bend.arrivals(self.maybe(0)), lambda: bend.step_error(self.maybe(4)), lambda: bend.options,
            lambda: bend.set_step(self.maybe(.5), self.maybe(.1)), lambda: im.ad.Adam(self.maybe(.1), params={"x": self.maybe(1.0)}).step({"x": values(r)}),
            lambda: im.Transform4f(values(r)), lambda: im.Transform4f.look_at(values(r), [0, 0, 0]),
        ]
        try:
            made = r.choice(calls)()
        except Exception:
            made = None
        if isinstance(made, (im.SceneParameters, im.Picture, im.bend.Field, im.bend.Bend, im.elements.Elements, im.elements.Guide,
                             im.Scene)):
            self.kept.append(made)
        while len(self.kept) > 12:
            del self.kept[r.randrange(len(self.kept))]
        self.scenes = [s for s in self.scenes if "closed" not in repr(s) or r.random() < .9] or [im.load_dict(im.cornell_box(res=8, spp=2))]


def test_random_calls():
    """Random calls"""
    steps = int(os.environ.get("IMP_STEPS", 1500))
    im.set_progress(False)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for seed in range(4):
            world = World(seed)
            for _ in range(steps // 4):
                world.step()
            del world
            gc.collect()
    s = im.load_dict(im.cornell_box(res=8))
    assert im.render(s, spp=1).shape == (8, 8, 3)
    return "%d calls" % steps


run(globals())
