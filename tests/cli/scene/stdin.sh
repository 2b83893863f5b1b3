# SPDX-License-Identifier: Apache-2.0
importon info - <"$ROOT/scenes/furnace.xml" | head -n 1
