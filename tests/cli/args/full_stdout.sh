# SPDX-License-Identifier: Apache-2.0
# A full disk is noticed, although only the last flush fails.
importon info --json "$ROOT/scenes/furnace.xml" >/dev/full
importon render "$ROOT/scenes/furnace.xml" -q -m mono --spp 1 -o - >/dev/full
