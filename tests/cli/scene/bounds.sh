# SPDX-License-Identifier: Apache-2.0
# A value outside its bounds is refused, and nothing is traced.
cd "$SCENES" || exit 9
echo "+ inside [0, 1]" >&2
importon gradient --json --seed 7 -p 'ball.*' --set ball.reflectance.value=0.5 furnace.xml || exit 9
echo "+ outside" >&2
importon gradient --json --seed 7 -p 'ball.*' --set ball.reflectance.value=1.5 furnace.xml
