# SPDX-License-Identifier: Apache-2.0
# A picture appears whole or not at all.
echo before >picture.exr # --overwrite, or it would not be tried
(ulimit -f 1; importon render "$ROOT/scenes/furnace.xml" --spp 4 -q --overwrite -o picture.exr)
echo "exit $?" >&2
cat picture.exr
ls
