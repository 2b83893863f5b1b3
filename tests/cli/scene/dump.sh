# SPDX-License-Identifier: Apache-2.0
# The dump can be given back with --set.
cd "$SCENES" || exit 9
importon render --dump --set ball.reflectance.value=0.25 furnace.xml
