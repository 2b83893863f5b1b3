# SPDX-License-Identifier: Apache-2.0
# The dump as JSON has every number.
importon render --dump --json "$SCENES/furnace.xml"
