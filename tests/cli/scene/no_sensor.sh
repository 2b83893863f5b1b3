# SPDX-License-Identifier: Apache-2.0
# A scene without a camera can be looked at, not rendered.
cd "$SCENES" || exit 9
importon info no_sensor.xml >/dev/null || exit 9
importon render no_sensor.xml
