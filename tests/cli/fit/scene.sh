# SPDX-License-Identifier: Apache-2.0
# What a fit has found is a scene: its picture is that of the command line, wherever it is read from;
# textures have their last digit, and a folder has no textures of a former fit.
S=$SCENES/furnace.xml
same() { cmp -s "$1" "$2" && echo same || echo differs; }
importon render "$S" --spp 16 -q -o target.exr
mkdir -p a/b
importon fit "$S" -a "$SCENES" --set sky.radiance.value=1.25 -p ball.reflectance.value --target target.exr --optimizer lm \
    --spp 8 -n 2 -q -o a/b/found >/dev/null
sed 's|\(filename="\)[^"]*/|\1|; s|importon [0-9.]*|importon|; s|\(<path value="\)[^"]*"|\1DIR"|' a/b/found/scene.xml
importon render a/b/found/scene.xml --spp 8 --seed 3 -q -o scene.pfm
importon render "$S" --set sky.radiance.value=1.25 --set @a/b/found/recovered.txt --spp 8 --seed 3 -q -o set.pfm
same scene.pfm set.pfm
(cd a && importon render b/found/scene.xml --spp 8 --seed 3 -q -o ../inside.pfm)
same scene.pfm inside.pfm
importon fit a/b/found/scene.xml -p ball.reflectance.value --target target.exr --spp 8 -n 1 -q -o a/b/found
echo "exit $?" >&2
echo '<scene version="3.0.0"><include filename="a/b/found/scene.xml"/><set name="bal.reflectance.value" value="1"/></scene>' >wrong.xml
importon info wrong.xml
echo '<scene version="3.0.0"><set filename="secret"/></scene>' >wrong.xml
echo password >secret
importon info wrong.xml
echo "<scene version='3.0.0'><include filename='$ROOT/scenes/cornell.xml'/><set name='red.reflectance.value' value=' .4 .1, .2 '/></scene>" >lists.xml
importon info lists.xml --dump | grep '^red.reflectance\|"red.reflectance'
for set in 'name="a"' 'value="1"' 'name="a" value="1" filename="secret"' 'name="a=b" value="1"' 'filename="nowhere"'; do
    echo "<scene version='3.0.0'><set $set/></scene>" >wrong.xml
    importon info wrong.xml
done
echo '<scene version="3.0.0"><bsdf type="diffuse"><set name="a" value="1"/></bsdf></scene>' >wrong.xml
importon info wrong.xml
exit 0
