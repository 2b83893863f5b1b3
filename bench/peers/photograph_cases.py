# SPDX-License-Identifier: Apache-2.0
"""Scenes for photographs.py: what is there, what a person would guess, and what he would have wrong.

A case has the text of its objects with {names} of numbers, their true values and guesses, cameras, and two mistakes:
`lamp`, a light that the scene has at nearly nothing and is held there, and `material`, an input of a material that is
held at a wrong value. Numbers are called as importon's parameters, so that the answer is found by name.
"""
import math

CORNELL = """
<integrator type="path"><integer name="max_depth" value="6"/></integrator>
<bsdf type="diffuse" id="white"><rgb name="reflectance" value="{white.reflectance.value}"/></bsdf>
<bsdf type="diffuse" id="red"><rgb name="reflectance" value="{red.reflectance.value}"/></bsdf>
<bsdf type="diffuse" id="green"><rgb name="reflectance" value="{green.reflectance.value}"/></bsdf>
<shape type="rectangle"><transform name="to_world"><rotate x="1" angle="-90"/><translate y="-1"/></transform><ref id="white"/></shape>
<shape type="rectangle"><transform name="to_world"><rotate x="1" angle="90"/><translate y="1"/></transform><ref id="white"/></shape>
<shape type="rectangle"><transform name="to_world"><translate z="-1"/></transform><ref id="white"/></shape>
<shape type="rectangle"><transform name="to_world"><rotate y="1" angle="90"/><translate x="-1"/></transform><ref id="red"/></shape>
<shape type="rectangle"><transform name="to_world"><rotate y="1" angle="-90"/><translate x="1"/></transform><ref id="green"/></shape>
<shape type="cube"><transform name="to_world"><scale x=".28" y=".28" z=".28"/><rotate y="1" angle="-18"/><translate x=".35" y="-.715" z=".35"/></transform>
 <bsdf type="diffuse" id="block"><rgb name="reflectance" value="{block.reflectance.value}"/></bsdf></shape>
<shape type="cube"><transform name="to_world"><scale x=".28" y=".58" z=".28"/><rotate y="1" angle="22"/><translate x="-.35" y="-.415" z="-.3"/></transform><ref id="white"/></shape>
<shape type="rectangle"><transform name="to_world"><scale value=".3"/><rotate x="1" angle="90"/><translate x="{lamp_x}" y=".985" z="{lamp_z}"/></transform>
 <emitter type="area" id="lamp"><rgb name="radiance" value="{lamp.radiance.value}"/></emitter></shape>
<shape type="rectangle"><transform name="to_world"><scale value=".15"/><rotate y="1" angle="90"/><translate x="-.98" y=".1" z=".4"/></transform>
 <emitter type="area" id="second"><rgb name="radiance" value="{second.radiance.value}"/></emitter></shape>
"""

STILL = """
<integrator type="path"><integer name="max_depth" value="5"/></integrator>
<shape type="rectangle"><transform name="to_world"><scale value="2"/><rotate x="1" angle="-90"/></transform>
 <bsdf type="diffuse" id="floor"><texture type="bitmap" name="reflectance"><string name="filename" value="tiles.ppm"/>
 <boolean name="raw" value="true"/></texture></bsdf></shape>
<shape type="sphere"><point name="center" value="-.45, .4, 0"/><float name="radius" value=".4"/>
 <bsdf type="roughconductor" id="metal"><float name="alpha" value="{metal.alpha.value}"/><string name="material" value="none"/>
 <rgb name="specular_reflectance" value="{metal.specular_reflectance.value}"/></bsdf></shape>
<shape type="cube"><transform name="to_world"><scale value=".32"/><rotate y="1" angle="30"/><translate x=".5" y=".325" z=".2"/></transform>
 <bsdf type="roughplastic" id="plastic"><rgb name="diffuse_reflectance" value="{plastic.diffuse_reflectance.value}"/>
 <float name="alpha" value="{plastic.alpha.value}"/></bsdf></shape>
<emitter type="envmap" id="sky"><string name="filename" value="sky.pfm"/><float name="scale" value="{sky.scale.value}"/></emitter>
<shape type="rectangle"><transform name="to_world"><scale value=".3"/><rotate x="1" angle="90"/><translate x=".3" y="2" z=".6"/></transform>
 <emitter type="area" id="second"><rgb name="radiance" value="{second.radiance.value}"/></emitter></shape>
"""

FOG = """
<integrator type="volpath"><integer name="max_depth" value="12"/></integrator>
<bsdf type="diffuse" id="wall"><rgb name="reflectance" value="{wall.reflectance.value}"/></bsdf>
<bsdf type="diffuse" id="side"><rgb name="reflectance" value="{side.reflectance.value}"/></bsdf>
<shape type="rectangle"><transform name="to_world"><rotate x="1" angle="-90"/><translate y="-1"/></transform><ref id="wall"/></shape>
<shape type="rectangle"><transform name="to_world"><rotate x="1" angle="90"/><translate y="1"/></transform><ref id="wall"/></shape>
<shape type="rectangle"><transform name="to_world"><translate z="-1"/></transform><ref id="wall"/></shape>
<shape type="rectangle"><transform name="to_world"><rotate y="1" angle="90"/><translate x="-1"/></transform><ref id="side"/></shape>
<shape type="rectangle"><transform name="to_world"><rotate y="1" angle="-90"/><translate x="1"/></transform><ref id="wall"/></shape>
<shape type="rectangle"><transform name="to_world"><scale value=".35"/><rotate x="1" angle="90"/><translate y=".985"/></transform>
 <emitter type="area" id="lamp"><rgb name="radiance" value="{lamp.radiance.value}"/></emitter></shape>
<shape type="rectangle"><transform name="to_world"><scale value=".15"/><rotate y="1" angle="90"/><translate x="-.98" y=".1" z=".4"/></transform>
 <emitter type="area" id="second"><rgb name="radiance" value="{second.radiance.value}"/></emitter></shape>
<shape type="cube"><transform name="to_world"><scale x=".95" y=".5" z=".95"/><translate y="-.48"/></transform><bsdf type="null"/>
 <medium name="interior" type="homogeneous" id="fog"><float name="sigma_t" value="{fog.sigma_t.value}"/><rgb name="albedo" value="{fog.albedo.value}"/></medium></shape>
"""


def about(rng, low, high, n=1):
    """A number, or a colour."""
    v = [rng.uniform(low, high) for _ in range(n)]
    return v[0] if n == 1 else tuple(v)


def off(rng, value, part):
    """A guess: wrong by a factor of up to 1 + part either way."""
    wrong = lambda v: v * math.exp(rng.uniform(-1, 1) * math.log(1 + part))
    return tuple(map(wrong, value)) if isinstance(value, tuple) else wrong(value)


class Case:
    """world with {names}; truth, guess: values by name; cameras: (origin, target, fov in degrees)."""

    def __init__(self, name, world, truth, guess, cameras, rng, moved=0.0, hold=(), params=(), mistakes=None, bright=0.5):
        self.name, self.world, self.truth, self.guess, self.cameras = name, world, truth, guess, cameras
        self.hold, self.params, self.mistakes, self.bright = list(hold), list(params), mistakes, bright
        shift = lambda: [rng.uniform(-1, 1) * moved for _ in range(3)]
        self.guessed = [([a + d for a, d in zip(o, shift())], [a + d for a, d in zip(t, shift())], fov) for o, t, fov in cameras]

    def text(self, values):
        out = self.world
        for name, v in values.items():
            out = out.replace("{%s}" % name, ", ".join("%.9g" % x for x in v) if isinstance(v, tuple) else "%.9g" % v)
        return out


NOTHING = (1e-6, 1e-6, 1e-6)  # of a lamp that is off


def cornell(rng, mistake=None):
    white, lamp = about(rng, .6, .8), about(rng, 6, 10)
    truth = {"white.reflectance.value": (white, white * about(rng, .95, 1), white * about(rng, .85, .95)),
             "red.reflectance.value": (about(rng, .5, .7), about(rng, .05, .15), about(rng, .05, .15)),
             "green.reflectance.value": (about(rng, .1, .2), about(rng, .4, .6), about(rng, .1, .2)),
             "block.reflectance.value": about(rng, .2, .8, 3),
             "lamp.radiance.value": (lamp, .8 * lamp, .6 * lamp), "second.radiance.value": NOTHING,
             "lamp_x": 0, "lamp_z": 0}
    guess = {k: off(rng, v, .3) for k, v in truth.items() if k.endswith("reflectance.value")}
    guess.update({k: truth[k] for k in truth if k not in guess})
    hold = ["second.*", "lamp.*"]
    if mistake == "lamp":
        truth["second.radiance.value"] = (2., 2.5, 3.)
    if mistake == "material":
        guess["block.reflectance.value"] = tuple(v * .6 for v in truth["block.reflectance.value"])
        hold.append("block.*")
    z = about(rng, 3.2, 3.5)
    cameras = [((about(rng, -.9, -.5), about(rng, .2, .5), z), (0, -.1, 0), 38), ((about(rng, .5, .9), about(rng, -.3, .1), z), (0, -.1, 0), 38)]
    return Case("cornell", CORNELL, truth, guess, cameras, rng, moved=.04, hold=hold,
                mistakes={"lamp": "second.radiance", "material": "block.reflectance"})


def still(rng, mistake=None):
    truth = {"metal.alpha.value": about(rng, .15, .3), "metal.specular_reflectance.value": about(rng, .5, .9, 3),
             "plastic.diffuse_reflectance.value": about(rng, .2, .7, 3), "plastic.alpha.value": about(rng, .1, .25),
             "sky.scale.value": about(rng, .7, 1.4), "second.radiance.value": NOTHING}
    guess = {k: off(rng, v, .3) for k, v in truth.items() if k != "second.radiance.value"}
    guess["second.radiance.value"] = NOTHING
    hold = ["second.*", "floor.*", "sky.data", "sky.rotation", "metal.eta", "metal.k", "plastic.eta"]
    if mistake == "lamp":
        truth["second.radiance.value"] = (8., 7., 6.)
    if mistake == "material":
        guess["metal.alpha.value"] = truth["metal.alpha.value"] * 2
        hold.append("metal.alpha.*")
    cameras = [((about(rng, -1.4, -1), 1.2, 2.2), (0, .25, 0), 40), ((about(rng, 1, 1.4), 1.3, 2.1), (0, .25, 0), 40)]
    return Case("still", STILL, truth, guess, cameras, rng, hold=hold, mistakes={"lamp": "second.radiance", "material": "metal.alpha"})


def fog(rng, mistake=None):
    truth = {"wall.reflectance.value": about(rng, .5, .7, 3), "side.reflectance.value": about(rng, .2, .6, 3),
             "lamp.radiance.value": (8., 7., 6.), "fog.sigma_t.value": about(rng, .4, .9), "fog.albedo.value": about(rng, .7, .9, 3),
             "second.radiance.value": NOTHING}
    guess = {k: off(rng, v, .25 if "albedo" not in k else .1) for k, v in truth.items() if "radiance" not in k}
    guess.update({k: truth[k] for k in truth if k not in guess})
    hold = ["second.*", "lamp.*", "fog.scale"]
    if mistake == "lamp":
        truth["second.radiance.value"] = (2., 2.5, 3.)
    if mistake == "material":
        guess["side.reflectance.value"] = tuple(v * .6 for v in truth["side.reflectance.value"])
        hold.append("side.*")
    cameras = [((about(rng, -.6, -.3), 0, 3.3), (0, -.1, 0), 38), ((about(rng, .3, .6), .2, 3.3), (0, -.1, 0), 38)]
    return Case("fog", FOG, truth, guess, cameras, rng, hold=hold, mistakes={"lamp": "second.radiance", "material": "side.reflectance"})


def lamp(rng, mistake=None):
    """The Cornell box with known cameras and paints of which two are known; the lamp hangs somewhere."""
    case = cornell(rng, mistake)
    case.name, case.guessed = "lamp", case.cameras
    case.truth.update(lamp_x=about(rng, -.2, .2), lamp_z=about(rng, -.2, .2))
    case.params = ["lamp_shape.pose", "*.reflectance.*", "lamp.*", "*.exposure.*", "*.vignetting*", "*.white_balance*"]
    case.hold = ["lamp_shape.pose[1]", "lamp_shape.pose[3-5]"] + [h for h in case.hold if h != "lamp.*"]
    case.world = case.world.replace('<shape type="rectangle"><transform name="to_world"><scale value=".3"/>',
                                    '<shape type="rectangle" id="lamp_shape"><transform name="to_world"><scale value=".3"/>').replace('y=".985"', 'y=".9"')
    return case


KINDS = {"cornell": cornell, "still": still, "fog": fog, "lamp": lamp}
