# SPDX-License-Identifier: Apache-2.0
# <integrator type="elements"> in a file: render makes the picture that `elements` makes, and the
# command's options stand above the file's.
cp "$ROOT/scenes/elements/b.xml" b.xml
sed 's|<integrator type="path"/>|<integrator type="elements"><float name="eps" value="5e-3"/>\
<string name="image" value="flat"/><integer name="rays" value="3"/></integrator>|' b.xml >e.xml
importon info e.xml | grep integrator
importon render e.xml -m mono -D res=16 --spp 9 -q -o a.pfm || exit 9
importon elements e.xml -m mono -D res=16 --image flat -q -o b.pfm || exit 9
importon elements b.xml -m mono -D res=16 --image flat --eps 5e-3 --rays 3 -q -o c.pfm || exit 9
importon elements e.xml -m mono -D res=16 --image flat --eps 2e-2 -q -o d.pfm || exit 9
cmp a.pfm b.pfm && cmp a.pfm c.pfm && ! cmp -s a.pfm d.pfm && echo same
