# SPDX-License-Identifier: Apache-2.0
# A scene as the add-on for Blender writes it: the scene and its fragments in one folder, meshes
# as binary .ply in meshes/, pictures in textures/, a mesh of two materials as a group with an
# instance, shadeless lamps, materials by the names of Blender's, with matrices for transforms.
mkdir -p meshes textures fragments || exit 9
python3 - <<'PY' || exit 9
import struct
def ply(name, vertices, faces, fields="x y z nx ny nz u v"):
    names = fields.split()
    with open(f"meshes/{name}.ply", "wb") as f:
        f.write(b"ply\nformat binary_little_endian 1.0\n")
        f.write(f"element vertex {len(vertices)}\n".encode())
        for n in names:
            f.write(f"property float {n}\n".encode())
        f.write(f"element face {len(faces)}\nproperty list uchar int vertex_index\nend_header\n".encode())
        for v in vertices:
            f.write(struct.pack(f"<{len(names)}f", *v))
        for t in faces:
            f.write(struct.pack("<B3i", 3, *t))
square = [(-1, -1), (1, -1), (1, 1), (-1, 1)]
two = [(0, 1, 2), (0, 2, 3)]
def plane(size, z):
    return [(size * x, size * y, z, 0, 0, 1, (x + 1) / 2, (y + 1) / 2) for x, y in square]
ply("Plane", plane(6, 0), two)
ply("Lamp", [(x, y, 5, 0, 0, -1, 0, 0) for x, y in square], [(0, 2, 1), (0, 3, 2)])
ply("Cube_001-Red", plane(1, 1), two)
ply("Cube_001-Glass", plane(0.5, 1.5), two)
ply("Painted", [v + (0.1 + 0.2 * k, 0.5, 0.7 - 0.1 * k) for k, v in enumerate(plane(1, 2))], two,
    "x y z nx ny nz u v r g b")
PY
printf 'P6 2 2 255\n\377\000\000\000\377\000\000\000\377\377\377\377' > textures/Checker.ppm
cat > scene.xml <<'XML'
<scene version="3.0.0">
  <!-- Defaults, these can be set via the command line: -Darg=value -->
  <default name="spp" value="4"/>
  <default name="resx" value="8"/>
  <default name="resy" value="6"/>
  <!-- Camera and Rendering Parameters -->
  <integrator type="path"><integer name="max_depth" value="8"/></integrator>
  <sensor type="perspective" id="Camera" name="Camera">
    <string name="fov_axis" value="x"/>
    <float name="fov" value="39.597755335771296"/>
    <float name="principal_point_offset_x" value="0.000000"/>
    <float name="principal_point_offset_y" value="-0.000000"/>
    <float name="near_clip" value="0.100000"/>
    <float name="far_clip" value="100.000000"/>
    <transform name="to_world">
      <rotate x="1" angle="63.559301"/>
      <rotate z="1" angle="-46.691944"/>
      <matrix value="1 0 0 0  0 1 0 0  0 0 1 0  0 0 0 1"/>
      <translate value="7.358891 6.925791 4.958309"/>
    </transform>
    <sampler type="independent"><integer name="sample_count" value="$spp"/></sampler>
    <film type="hdrfilm">
      <integer name="width" value="$resx"/>
      <integer name="height" value="$resy"/>
      <rfilter type="box"/>
    </film>
  </sensor>
  <include filename="fragments/scene-materials.xml"/>
  <include filename="fragments/scene-geometry.xml"/>
  <!-- Emitters -->
  <emitter type="constant" id="World" name="World"><rgb name="radiance" value="0.050876 0.050876 0.050876"/></emitter>
  <emitter type="point" id="emit-Light" name="emit-Light">
    <point name="position" x="4.076245" y="1.005454" z="5.903862"/>
    <rgb name="intensity" value="79.577469 79.577469 79.577469"/>
  </emitter>
  <emitter type="directional" id="emit-Sun">
    <rgb name="irradiance" value="1 1 1"/>
    <transform name="to_world"><matrix value="1 0 0 0  0 -1 0 0  0 0 -1 4  0 0 0 1"/></transform>
  </emitter>
</scene>
XML
cat > fragments/scene-materials.xml <<'XML'
<scene version="3.0.0">
  <bsdf type="twosided" id="mat-Floor" name="mat-Floor">
    <bsdf type="principled" name="bsdf">
      <texture type="bitmap" name="base_color"><string name="filename" value="textures/Checker.ppm"/></texture>
      <float name="specular" value="0.500000"/><float name="spec_tint" value="0.000000"/>
      <float name="metallic" value="0.000000"/><float name="anisotropic" value="0.000000"/>
      <float name="roughness" value="0.400000"/><float name="sheen" value="0.000000"/>
      <float name="sheen_tint" value="0.500000"/><float name="clearcoat" value="0.000000"/>
      <float name="clearcoat_gloss" value="0.030000"/><float name="spec_trans" value="0.000000"/>
    </bsdf>
  </bsdf>
  <bsdf type="twosided" id="mat-Red" name="mat-Red">
    <bsdf type="blendbsdf" name="bsdf">
      <float name="weight" value="0.5"/>
      <bsdf type="diffuse" name="bsdf1"><rgb name="reflectance" value="0.800000 0.100000 0.100000"/></bsdf>
      <bsdf type="roughconductor" name="bsdf2">
        <float name="alpha" value="0.25"/><string name="distribution" value="ggx"/>
        <rgb name="specular_reflectance" value="0.8 0.8 0.8"/>
      </bsdf>
    </bsdf>
  </bsdf>
  <bsdf type="roughdielectric" id="mat-Glass" name="mat-Glass">
    <float name="alpha" value="0.1"/><string name="distribution" value="beckmann"/>
    <float name="int_ior" value="1.450000"/>
    <rgb name="specular_transmittance" value="1 1 1"/>
  </bsdf>
  <bsdf type="twosided" id="mat-Painted" name="mat-Painted">
    <bsdf type="diffuse" name="bsdf">
      <texture type="mesh_attribute" name="reflectance"><string name="name" value="vertex_color"/></texture>
    </bsdf>
  </bsdf>
  <bsdf type="diffuse" id="empty-emitter-bsdf" name="empty-emitter-bsdf"><rgb name="reflectance" value="0"/></bsdf>
</scene>
XML
cat > fragments/scene-geometry.xml <<'XML'
<scene version="3.0.0">
  <shape type="ply" id="mesh-Plane" name="mesh-Plane">
    <string name="filename" value="meshes/Plane.ply"/>
    <boolean name="face_normals" value="true"/>
    <ref id="mat-Floor" name="bsdf"/>
  </shape>
  <shape type="ply" id="mesh-Painted"><string name="filename" value="meshes/Painted.ply"/><ref id="mat-Painted" name="bsdf"/></shape>
  <shape type="ply" id="mesh-Lamp">
    <string name="filename" value="meshes/Lamp.ply"/>
    <ref id="empty-emitter-bsdf" name="bsdf"/>
    <emitter type="area" name="emitter"><rgb name="radiance" value="5 5 4"/></emitter>
  </shape>
  <shape type="shapegroup" id="mesh-Cube_001">
    <shape type="ply" id="Cube_001-Red"><string name="filename" value="meshes/Cube_001-Red.ply"/><ref id="mat-Red" name="bsdf"/></shape>
    <shape type="ply" id="Cube_001-Glass"><string name="filename" value="meshes/Cube_001-Glass.ply"/><ref id="mat-Glass" name="bsdf"/></shape>
  </shape>
  <shape type="instance"><ref id="mesh-Cube_001" name="shape"/></shape>
  <shape type="instance">
    <ref id="mesh-Cube_001" name="shape"/>
    <transform name="to_world"><matrix value="1 0 0 3  0 1 0 0  0 0 1 0  0 0 0 1"/></transform>
  </shape>
</scene>
XML
importon info scene.xml | sed -n 's/  .*//p' || exit 9
importon info --json scene.xml | grep -c '"not_supported":\[\]'
importon render -q -o picture.exr scene.xml || exit 9
importon check -q --draws-time 0.1 --paths 50 --spp 16 --param 'mat-*' scene.xml > checked || cat checked
rm -r scene.xml picture.exr checked meshes textures fragments
