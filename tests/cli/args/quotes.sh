# SPDX-License-Identifier: Apache-2.0
# A pattern without quotes: the shell has made two file names of it.
touch white.exr white.png
importon gradient "$ROOT/scenes/furnace.xml" -p white*
