# SPDX-License-Identifier: Apache-2.0
# A scene without a camera, or without an integrator, can be looked at, not rendered: the message says where.
cd "$SCENES" || exit 9
importon info no_sensor.xml >/dev/null || exit 9
printf '<!-- empty -->\n  <scene version="3.0.0">\n<sensor type="perspective"/></scene>' >"$OUT/no_integrator.xml"
importon info "$OUT/no_integrator.xml" >/dev/null || exit 9
(cd "$OUT" && importon render no_integrator.xml)
importon render no_sensor.xml
