# SPDX-License-Identifier: Apache-2.0
cd "$SCENES" || exit 9
for set in ball.reflectance.value ball.reflectance.value=red ball.reflectance.value=.1,.2 =1; do
    importon info --set $set furnace.xml
    echo "exit $?" >&2
done
