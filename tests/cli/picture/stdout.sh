# SPDX-License-Identifier: Apache-2.0
# A pipe gets the EXR file and nothing else; the reader takes it from a pipe too.
importon render "$ROOT/scenes/furnace.xml" -D res=8 --spp 4 -q -o a.exr || exit 9
importon render "$ROOT/scenes/furnace.xml" -D res=8 --spp 4 -q -o - | importon compare - a.exr
