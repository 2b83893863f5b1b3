# SPDX-License-Identifier: Apache-2.0
importon render "$ROOT/scenes/furnace.xml" -D res=8 --spp 4 -q -o t.exr || exit 9
importon gradient "$ROOT/scenes/furnace.xml" --adjoint t.exr
