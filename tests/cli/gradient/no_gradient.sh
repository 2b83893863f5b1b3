# SPDX-License-Identifier: Apache-2.0
# A parameter that does not exist, and one without a gradient, are refused.
cd "$ROOT/scenes" && importon gradient furnace.xml -p 'bell.*'
importon gradient cornell.xml -p White # in other letters: its parameters
