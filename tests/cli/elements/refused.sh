# SPDX-License-Identifier: Apache-2.0
# What cannot be projected is refused by its name, and nothing is written.
cp "$ROOT/scenes/elements/b.xml" . || exit 9
cat >glass.xml <<END
<scene version="3.0.0"><sensor type="perspective"/>
<shape type="sphere" id="ball"/><shape type="rectangle"><emitter type="area"/></shape></scene>
END
importon elements glass.xml -o out.png
code=$?
[[ ! -e out.png ]] || exit 9
cat >sky.xml <<END
<scene version="3.0.0"><sensor type="perspective"/>
<shape type="rectangle"/>
  <emitter type="constant"/></scene>
END
importon elements sky.xml -o out.png && exit 9
cat >mirror.xml <<END
<scene version="3.0.0"><sensor type="perspective"/>
<shape type="rectangle"><emitter type="area"/>
<bsdf type="conductor"/></shape></scene>
END
importon elements mirror.xml -o out.png && exit 9
printf '<!-- lit, and not looked at -->\n<scene version="3.0.0"><shape type="rectangle"><emitter type="area"/></shape></scene>' >unseen.xml
importon elements unseen.xml -q -o out.png && exit 9
importon elements b.xml --phong 'floor=1' -o out.png && exit 9
importon elements b.xml --lux 'nothing' -o out.png && exit 9
importon elements b.xml --lux '0:floor' -o out.png && exit 9
importon elements b.xml --plane 'nan,0,0,1,0,0,0,1,0' -o out.png && exit 9
# As an integrator it makes no walks: what needs them says so.
sed 's/type="path"/type="elements"/' b.xml >e.xml
importon gradient e.xml && exit 9
importon render e.xml --pixel 3,4 && exit 9
exit $code
