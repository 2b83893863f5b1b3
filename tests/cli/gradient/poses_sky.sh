# SPDX-License-Identifier: Apache-2.0
# A camera's pose over glossy floors with a texture, under a sky: directions that walks have
# decided are floats, and are one long where their derivatives are taken.
for material in '<bsdf type="roughplastic"><float name="alpha" value="0.2"/><texture type="bitmap" name="diffuse_reflectance">' \
    '<bsdf type="principled"><float name="roughness" value="0.4"/><texture type="bitmap" name="base_color">'; do
    for sky in constant ciesky; do
        cat >scene.xml <<END
<scene version="3.0.0"><integrator type="path"><integer name="max_depth" value="3"/></integrator>
<sensor type="perspective" id="camera"><float name="fov" value="40"/>
<transform name="to_world"><lookat origin="0, -3, 2" target="0, 0, 0" up="0, 0, 1"/></transform>
<film type="hdrfilm"><integer name="width" value="24"/><integer name="height" value="24"/><rfilter type="box"/></film></sensor>
<emitter type="$sky"/>
<shape type="rectangle">$material<string name="filename" value="$ROOT/scenes/textured/waves.png"/></texture></bsdf></shape>
</scene>
END
        importon check scene.xml -p camera.pose --only frozen 2>summary | awk '$1 == "frozen" {print $2, ($6 < 1e-7 ? "within 1e-7" : $6), $NF}'
    done
done
