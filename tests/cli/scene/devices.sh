# SPDX-License-Identifier: Apache-2.0
# Devices are not read: they may never end. /dev/null is an empty file.
export MALLOC_ARENA_MAX=1
for device in /dev/urandom /dev/zero /dev/null; do
    importon info $device
    for plugin in obj ply serialized; do
        echo "<scene version='3.0.0'><shape type='$plugin'><string name='filename' value='$device'/></shape></scene>" >scene.xml
        importon info scene.xml
    done
    echo "<scene version='3.0.0'><shape type='sphere'><bsdf type='diffuse'><texture type='bitmap' name='reflectance'><string name='filename' value='$device'/></texture></bsdf></shape></scene>" >scene.xml
    importon info scene.xml
    importon gradient "$ROOT/scenes/furnace.xml" -D res=4 --spp 1 -T $device
    importon merge $device
    importon verify $device
    importon what-if $device
    importon fit "$ROOT/scenes/furnace.xml" -T $device --checkpoint $device --resume
done
