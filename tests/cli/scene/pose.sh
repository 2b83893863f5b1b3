# A shape and a camera that the command line moves: the picture is another one, moved by nothing it
# is the same, and what cannot move is named.
render() { importon render -q -D res=8 --spp 4 "$@" -o x.pfm "$ROOT/scenes/cornell.xml" && cksum <x.pfm; }
rest=$(render)
[[ $(render --set tall_block.pose=0,0,0,0,0,0 --set camera.pose=0,0,0,0,0,0) == "$rest" ]] && echo at rest: the same
[[ $(render --set tall_block.pose=20,0,0,0,0.3,0) != "$rest" ]] && echo a block that moves: another picture
[[ $(render --set camera.pose=0,0,9,0,0,0) != "$rest" ]] && echo a camera that moves: another picture
importon info --set tall_block.pose=20,0,0,0,0.3,0 "$ROOT/scenes/cornell.xml" | grep 'pose .*numbers'
importon info "$ROOT/scenes/cornell.xml" | sed -n '/^geometry/,$p'
render --set tall_blok.pose=1,0,0,0,0,0
importon gradient -q -D res=8 --spp 1 -p tall_block.poze "$ROOT/scenes/cornell.xml"
render --set white.pose=1,0,0,0,0,0
render --set tall_block.pose=1,2
importon gradient -q -D res=8 --spp 4 -p tall_block.pose "$ROOT/scenes/cornell.xml" | grep -c 'tall_block.pose\['
importon gradient -q -D res=8 --spp 4 -p tall_block.pose --target x.pfm "$ROOT/scenes/cornell.xml" | grep -c 'tall_block.pose\['
importon gradient -q -D res=8 --spp 4 -p tall_block.pose --set tall_block.pose=0,-9,0,0,0,0 "$ROOT/scenes/cornell.xml" | grep -c 'tall_block.pose\['
importon fit -q -D res=8 --spp 4 -p tall_block.pose --target x.pfm --set light_panel.pose=0,-300,0,0,0,0 "$ROOT/scenes/cornell.xml"
importon fit -q -D res=8 --spp 4 -p block.pose --target x.pfm --levels 2 --optimizer lbfgs "$ROOT/scenes/poses.xml"
importon check -q -D res=8 --spp 4 -p tall_block.pose --only frozen "$ROOT/scenes/cornell.xml" | grep -c ok
importon gradient -q -D res=8 --spp 4 -p tall_block.to_world "$ROOT/scenes/cornell.xml" | grep -c 'tall_block.to_world\['
render --set tall_block.to_world=1,0,0,0,0,1,0,0,0,0,0,0
render --set tall_block.to_world=-1,0,0,0,0,1,0,0,0,0,1,0
render --set camera.to_world=2,0,0,0,0,1,0,0,0,0,1,0
render --set tall_block.pose=0,0,0,0,0,0 --set tall_block.to_world=1
importon fit -q -D res=8 --spp 4 -p camera.to_world --target x.pfm "$ROOT/scenes/cornell.xml"
importon check -q -D res=8 --spp 4 -p camera.to_world --only fresh "$ROOT/scenes/cornell.xml" | grep -c open
