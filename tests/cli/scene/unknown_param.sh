# SPDX-License-Identifier: Apache-2.0
# The nearest name is suggested.
cd "$SCENES" || exit 9
importon render --set ball.reflectence.value=0.3 furnace.xml
importon render --set ball=0.3 furnace.xml # an object: its parameters
