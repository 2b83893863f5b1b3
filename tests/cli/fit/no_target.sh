# SPDX-License-Identifier: Apache-2.0
importon fit "$ROOT/scenes/furnace.xml"
