# SPDX-License-Identifier: Apache-2.0
# Spectra and response curves that are none are errors with their place.
scene() { # CHILDREN OF THE MATERIAL, CHILDREN OF THE SENSOR
    importon info -m spectral - <<<"<scene version='3.0.0'><emitter type='constant'/>
<sensor type='perspective'>${2:-}</sensor>
<shape type='sphere'><bsdf type='diffuse' id='paint'>${1:-}</bsdf></shape></scene>" | sed -n 's/^integrator.*/&, fine/p'
}
points() { scene "<spectrum name='reflectance' value='$1'/>"; }
points '400:.1, 500:.2'
points '400:.1, 390:.2'
points ''
points '400:.1'
points '400:-.1, 500:.2'
points '400:.1, 500:1.2'
points '400:.1, 500:nan'
points '.4:.1, .7:.2'
file() {
    printf "$1" >a.spd
    scene "<spectrum name='reflectance' filename='a.spd'/>"
}
file ''
file '# nothing\n'
file '400 .1\n'
file '500 .1\n400 .2\n'
file '400 .1\n500 -.2\n'
file '400 .1 .3\n500 .2\n'
file '400 x\n500 .2\n'
regular() {
    scene "<spectrum name='reflectance' type='regular'><string name='values' value='$1'/>
<float name='wavelength_min' value='$2'/><float name='wavelength_max' value='$3'/></spectrum>"
}
regular '.1 .2 .3' 400 700
regular '.1' 400 700
regular '' 400 700
regular '.1 .2' 700 400
irregular() {
    scene "<spectrum name='reflectance' type='irregular'><string name='values' value='$1'/>
<string name='wavelengths' value='$2'/></spectrum>"
}
irregular '.1 .2' '400'
irregular '.1 .2' '500 400'
film() { scene "" "<film type='specfilm'>$1</film>"; }
film "<spectrum name='a' value='400:0, 500:1'/>"
film ""
film "<spectrum name='a' value='400:0, 500:0'/>"
film "<spectrum name='a' value='500:1, 400:1'/>"
film "<spectrum name='a' value='400:1'/>"
film "<spectrum name='a' value='400:1, 500:1'/><spectrum name='a' value='400:1, 500:1'/>"
film "<spectrum name='a' filename='none.spd'/>"
film "<spectrum name='a' value='400:1, 500:-.1, 600:1'/>"
film "<spectrum name='a' value='-.1'/>"
film "<spectrum name='a' value='800:0, 850:0, 900:1, 950:0'/>"
film "<spectrum name='a' value='800:0, 825:0, 900:1, 950:0'/>"
srf() { scene "" "<spectrum name='srf' value='$1'/>${2:-}"; }
srf '400:0, 500:1'
srf '400:0, 500:0'
srf '400:0, 500:-1'
srf '840:1, 900:1'
srf '400:0, 500:1' "<film type='specfilm'><spectrum name='a' value='400:1, 500:1'/></film>"
importon info - <<<"<scene version='3.0.0'><sensor type='perspective'>
<spectrum name='srf' value='400:0, 500:1'/></sensor></scene>"
importon info - <<<"<scene version='3.0.0'><sensor type='perspective'><film type='specfilm'>
<spectrum name='a' value='400:0, 500:1'/></film></sensor></scene>"
# A colour in rgb that is not what its samples are.
importon info - <<<"<scene version='3.0.0'><emitter type='constant'/><shape type='sphere'>
<bsdf type='diffuse' id='infrared'><spectrum name='reflectance' value='900:.1, 1700:.2'/></bsdf></shape>
<shape type='sphere'><bsdf type='diffuse' id='percent'>
<spectrum name='reflectance' value='400:20, 700:30'/></bsdf></shape></scene>" | grep reflectance
# Infrared light beside an rgb film, and beside one that sees it.
infrared() {
    importon info -m spectral - <<<"<scene version='3.0.0'><sensor type='perspective'>$1</sensor>
<shape type='sphere' id='coal'><emitter type='area'><spectrum name='radiance' value='900:1, 1000:2'/></emitter></shape>
<emitter type='point' id='lamp'><spectrum name='intensity' value='840:1, 880:2'/></emitter>
<emitter type='point' id='bulb'><spectrum name='intensity' value='800:1, 880:2'/></emitter></scene>" | grep emitters
}
infrared "<film type='hdrfilm'/>"
infrared "<film type='specfilm'><spectrum name='a' value='700:1, 1000:1'/></film>"
