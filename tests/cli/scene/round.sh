# Centre and radius of a sphere, ends and radius of a cylinder as parameters: the same picture where they
# are as the file says, another one where they move, and what is refused.
cat >round.xml <<'XML'
<scene version='3.0.0'><integrator type='direct'/><emitter type='constant'/>
<sensor type='perspective'><transform name='to_world'><lookat origin='0,-5,1' target='0,0,0' up='0,0,1'/></transform>
<film type='hdrfilm'><integer name='width' value='8'/><integer name='height' value='8'/></film></sensor>
<shape type='sphere' id='ball'><point name='center' value='1,0,.5'/><float name='radius' value='.4'/></shape>
<shape type='cylinder' id='tube'><point name='p0' value='-1,0,0'/><point name='p1' value='-1,.5,1'/><float name='radius' value='.3'/></shape>
</scene>
XML
render() { importon render -q --spp 4 "$@" -o x.pfm round.xml && cksum <x.pfm; }
rest=$(render)
[[ $(render --set ball.center=1,0,.5 --set ball.radius=.4) == "$rest" ]] && echo a ball at rest: the same
[[ $(render --set ball.radius=.5) != "$rest" ]] && echo a ball that grows: another picture
[[ $(render --set tube.p1=-1,.7,1) != "$rest" ]] && echo a tube that leans: another picture
importon info --set ball.center=1,0,.6 --set tube.radius=.35 round.xml | grep -E '^(ball|tube)\.'
importon gradient -q --spp 4 -p ball.center -p ball.radius -p tube.p0 -p tube.p1 -p tube.radius round.xml | grep -cE '^(ball|tube)\.'
importon fit -q --spp 4 -p ball.radius --target x.pfm round.xml | grep -c '^ball.radius'
render --set ball.radius=-1
render --set tube.p1=-1,0,0
render --set tube.center=0,0,0
render --set ball.pose=0,0,0,0,0,0 --set ball.center=1,0,.5
