# A curve whose points and pose the command line moves; what it cannot be.
printf '%s\n' '-1.4 -.9 .2 .3' '-.8 -.2 0 .25' '-.1 .3 .4 .32' '.6 .1 .1 .28' '1.1 .8 -.2 .2' >strand.txt
cat >strand.xml <<'XML'
<scene version="3.0.0">
    <integrator type="path"/>
    <sensor type="perspective" id="camera">
        <transform name="to_world"><lookat origin="0,0,6" target="0,0,0" up="0,1,0"/></transform>
        <film type="hdrfilm"><integer name="width" value="8"/><integer name="height" value="8"/></film>
    </sensor>
    <emitter type="constant"/>
    <shape type="bsplinecurve" id="strand"><string name="filename" value="strand.txt"/></shape>
</scene>
XML
render() { importon render -q --spp 4 "$@" -o x.pfm strand.xml && cksum <x.pfm; }
points=-1.4,-.9,.2,.3,-.8,-.2,0,.25,-.1,.3,.4,.32,.6,.1,.1,.28,1.1,.8,-.2
rest=$(render)
[[ $(render --set strand.control_points=$points,.2) == "$rest" ]] && echo at rest: the same
[[ $(render --set strand.control_points=$points,.4) != "$rest" ]] && echo a wider end: another picture
[[ $(render --set strand.pose=.2,0,0,0,0,.3) != "$rest" ]] && echo a curve that moves: another picture
importon info strand.xml | sed -n '/^geometry/,$p'
importon info --set strand.control_points=$points,.2 strand.xml | grep 'control_points'
render --set strand.control_points=$points,-.2
render --set strand.control_points=1,2
render --set strand.pose=0,0,0,0,0,0 --set strand.control_points=$points,.2
render --set strand.to_world=1,0,0,0,0,1,0,0,0,0,1,0
importon gradient -q --spp 4 -p strand.control_points strand.xml | grep -c 'strand.control_points\['
importon gradient -q --spp 4 -p strand.control_points --target x.pfm strand.xml | grep -c 'strand.control_points\['
importon jacobian -q --spp 4 -p strand.control_points -o J strand.xml >j.txt && ls J | wc -l
importon check -q --spp 4 -p strand.pose -p strand.scale --only frozen strand.xml | grep -c ok
importon fit -q --spp 4 -p strand.pose --target x.pfm -n 1 -o fitted strand.xml >fit.txt && grep -c 'strand.pose\[' fit.txt
