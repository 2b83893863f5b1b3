# SPDX-License-Identifier: Apache-2.0
# Maps of the best candidate: each pixel has 1/read^2, of its own number alone.
importon plan "$SCENES/two_lamps.xml" -m mono --spp 4 --noise read=0.1 --sensors 1 --map map >/dev/null
ls
importon compare map-two.radiance.value.exr map-two.radiance.value.exr --json | sed 's/.*"mean_test":\([0-9.]*\).*/\1/'
importon compare map-one.radiance.value.exr map-one.radiance.value.exr --json | sed 's/.*"mean_test":\([0-9.]*\).*/\1/'
# Nothing of another kind is replaced.
echo mine >map-criterion.png
importon plan "$SCENES/two_lamps.xml" -m mono --spp 4 --sensors 1 --map map >/dev/null; echo $?
