/* SPDX-License-Identifier: Apache-2.0
 *
 * A scene around one object of every kind, with no more than it cannot be without. */
#ifndef IMP_TEST_BAD_ROWS_H
#define IMP_TEST_BAD_ROWS_H

#include <importon/importon.h>

#define FILM                                                                             \
    "<film type='hdrfilm'><integer name='width' value='4'/><integer name='height' "      \
    "value='4'/>"
#define EYE                                                                              \
    "<sensor type='perspective'><transform name='to_world'><translate "                  \
    "z='-8'/></transform>" FILM "</film></sensor>"
#define PATH  "<integrator type='path'/>"
#define FOG   "<integrator type='volpath'/>"
#define NULLS "<bsdf type='null'/>"
#define MUST  FILM "</film>"

/* '%' is the object. */
static const struct place {
    const char *tag, *scene;
} places[] = {
    {"bsdf", PATH EYE "<shape type='sphere'>%</shape>"},
    {"texture", PATH EYE "<shape type='sphere'><bsdf type='diffuse'>%</bsdf></shape>"},
    {"spectrum", PATH EYE "<shape type='sphere'><bsdf type='diffuse'>%</bsdf></shape>"},
    {"volume", FOG EYE "<shape type='cube'>" NULLS
                       "<medium type='heterogeneous' name='interior'>%</medium></shape>"},
    {"phase", FOG EYE "<shape type='sphere'>" NULLS
                      "<medium type='homogeneous' name='interior'>%</medium></shape>"},
    {"medium", FOG EYE "<shape type='sphere'>" NULLS "%</shape>"},
    {"shape", PATH EYE "%"},
    {"emitter", PATH EYE "%"},
    {"sensor", PATH "%"},
    {"film", PATH "<sensor type='perspective'>%</sensor>"},
    {"sampler", PATH "<sensor type='perspective'>" MUST "%</sensor>"},
    {"rfilter", PATH "<sensor type='perspective'>" FILM "%</film></sensor>"},
    {"integrator", EYE "%"},
};

#define LIT   PATH EYE "<shape type='rectangle'>%</shape>"
#define SHINE PATH EYE "<shape type='rectangle'><emitter type='area'>%</emitter></shape>"
#define NEED  "<bsdf type='diffuse'/>\n"
#define SLOT  "name='reflectance'"

#define PLAIN(tag, type, props)                                                          \
    {                                                                                    \
        tag, type, props, NULL, NULL, IMP_RGB                                            \
    }

/* Properties without which there is no such object, one on a line; its slot; where it stands if
 * that is not the place of its tag; the mode, if not rgb. */
static const struct row {
    const char *tag, *type, *props, *slot, *scene;
    enum imp_color_mode mode;
} rows[] = {
    PLAIN("bsdf", "twosided", NEED),
    PLAIN("bsdf", "mask", NEED),
    PLAIN("bsdf", "blendbsdf", NEED NEED "<float name='weight' value='.5'/>\n"),
    PLAIN("bsdf", "normalmap", NEED "<texture type='checkerboard' name='normalmap'/>\n"),
    PLAIN("bsdf", "bumpmap",
          NEED "<texture type='bitmap' name='a'><string name='filename' "
               "value='waves.png'/></texture>\n"),
    PLAIN("bsdf", "merl", "<string name='filename' value='small'/>\n"),
    PLAIN("bsdf", "measured", "<string name='filename' value='both'/>\n"),
    PLAIN("bsdf", "roughconductor", ""),
    PLAIN("bsdf", "roughconductor",
          "<float name='alpha_u' value='.2'/>\n<float name='alpha_v' value='.2'/>\n"),
    PLAIN("bsdf", "conductor",
          "<float name='eta' value='2'/>\n<float name='k' value='2'/>\n"),
    PLAIN("bsdf", "hair", "<float name='sigma_a' value='2'/>\n"),
    PLAIN("bsdf", "hair", ""),
    {"texture", "bitmap", "<string name='filename' value='waves.png'/>\n", SLOT, NULL,
     IMP_RGB},
    {"texture", "mesh_attribute", "<string name='name' value='vertex_a'/>\n", SLOT,
     PATH EYE "<shape type='sphere'><texture type='checkerboard' name='vertex_a'/><bsdf "
              "type='diffuse'>%</bsdf></shape>",
     IMP_RGB},
    {"texture", "checkerboard", "", SLOT, NULL, IMP_RGB},
    {"texture", "volume", "<volume type='constvolume' name='volume'/>\n", SLOT, NULL,
     IMP_RGB},
    {"texture", "d65", "<texture type='checkerboard' name='nested_texture'/>\n",
     "name='radiance'", SHINE, IMP_RGB},
    {"spectrum", "uniform", "", SLOT, NULL, IMP_RGB},
    {"spectrum", "uniform", "", SLOT, NULL, IMP_SPECTRAL},
    {"spectrum", "srgb", "<rgb name='color' value='.5'/>\n", SLOT, NULL, IMP_RGB},
    {"spectrum", "rawconstant", "<float name='value' value='.5'/>\n", SLOT, NULL,
     IMP_RGB},
    {"spectrum", "d65", "", "name='radiance'", SHINE, IMP_RGB},
    {"spectrum", "regular",
     "<string name='values' value='.1,.2'/>\n<float name='wavelength_min' "
     "value='400'/>\n<float name='wavelength_max' value='700'/>\n",
     SLOT, NULL, IMP_RGB},
    {"spectrum", "irregular",
     "<string name='values' value='.1,.2'/>\n<string name='wavelengths' "
     "value='400, 700'/>\n",
     SLOT, NULL, IMP_RGB},
    {"spectrum", "blackbody", "<float name='temperature' value='4000'/>\n",
     "name='radiance'", SHINE, IMP_SPECTRAL},
    {"spectrum", "illuminant", "<string name='name' value='A'/>\n", "name='radiance'",
     SHINE, IMP_RGB},
    {"spectrum", "rayleigh", "", "name='sigma_t'",
     FOG EYE "<shape type='sphere'>" NULLS
             "<medium type='homogeneous' name='interior'>%</medium></shape>",
     IMP_SPECTRAL},
    {"spectrum", "glass", "<string name='name' value='N-BK7'/>\n", "name='int_ior'",
     PATH EYE "<shape type='sphere'><bsdf type='dielectric'>%</bsdf></shape>", IMP_RGB},
    {"spectrum", "sellmeier",
     "<string name='B' value='1'/>\n<string name='C' value='.01'/>\n", "name='int_ior'",
     PATH EYE "<shape type='sphere'><bsdf type='dielectric'>%</bsdf></shape>", IMP_RGB},
    {"spectrum", "cauchy", "<string name='coefficients' value='1.5'/>\n",
     "name='int_ior'",
     PATH EYE "<shape type='sphere'><bsdf type='dielectric'>%</bsdf></shape>", IMP_RGB},
    {"volume", "constvolume", "", "name='sigma_t'", NULL, IMP_RGB},
    {"volume", "gridvolume", "<string name='filename' value='grey.vol'/>\n",
     "name='sigma_t'", NULL, IMP_RGB},
    {"volume", "expvolume",
     "<float name='top' value='1'/>\n<float name='scale_height' value='1'/>\n",
     "name='sigma_t'", NULL, IMP_RGB},
    PLAIN("phase", "blendphase",
          "<phase type='isotropic'/>\n<phase type='hg'/>\n<float name='weight' "
          "value='.5'/>\n"),
    PLAIN("phase", "tabphase", "<string name='values' value='1, 2, 3'/>\n"),
    {"medium", "homogeneous", "", "name='interior'", NULL, IMP_RGB},
    {"medium", "heterogeneous", "", "name='interior'", NULL, IMP_RGB},
    {"medium", "graded",
     "<volume type='luneburg'><float name='radius' value='1'/></volume>\n",
     "name='interior'", PATH EYE "<shape type='sphere'>" NULLS "%</shape>", IMP_RGB},
    PLAIN("shape", "obj", "<string name='filename' value='floor.obj'/>\n"),
    PLAIN("shape", "ply", "<string name='filename' value='paraboloid.ply'/>\n"),
    PLAIN("shape", "serialized", "<string name='filename' value='mesh.serialized'/>\n"),
    PLAIN("shape", "bsplinecurve", "<string name='filename' value='curve.txt'/>\n"),
    PLAIN("shape", "linearcurve", "<string name='filename' value='curve.txt'/>\n"),
    {"shape", "shapegroup", "<shape type='sphere'/>\n", "id='g'",
     PATH EYE "%<shape type='instance'><ref id='g'/></shape>", IMP_RGB},
    {"shape", "instance",
     "<ref id='g'/>\n<transform name='to_world_end'><translate x='1'/></transform>\n",
     NULL, PATH EYE "<shape type='shapegroup' id='g'><shape type='sphere'/></shape>%",
     IMP_RGB},
    {"emitter", "area", "", NULL, LIT, IMP_RGB},
    {"emitter", "stam_m1", "", NULL, LIT, IMP_RGB},
    {"emitter", "beam", "", NULL, LIT, IMP_RGB},
    {"emitter", "directionalarea", "", NULL, LIT, IMP_RGB},
    PLAIN("emitter", "ies", "<string name='filename' value='batwing.ies'/>\n"),
    {"emitter", "ies", "<string name='filename' value='batwing.ies'/>\n", NULL, LIT,
     IMP_RGB},
    PLAIN("emitter", "envmap", "<string name='filename' value='sky.pfm'/>\n"),
    PLAIN("emitter", "projector", "<texture type='checkerboard' name='irradiance'/>\n"),
    PLAIN("emitter", "sunsky", ""),
    PLAIN("emitter", "ciesky", ""),
    PLAIN("emitter", "perezsky",
          "<float name='diffuse' value='100'/>\n<float name='direct' value='300'/>\n"),
    PLAIN("sensor", "perspective", MUST "\n"),
    PLAIN("sensor", "perspective", MUST "\n<float name='opencv_fx' value='4'/>\n"),
    PLAIN("sensor", "thinlens", MUST "\n<float name='aperture_radius' value='.1'/>\n"),
    PLAIN("sensor", "thinlens",
          MUST "\n<float name='aperture_radius' value='.1'/>\n<float name='opencv_fx' "
               "value='4'/>\n"),
    PLAIN("sensor", "radiancemeter",
          "<film type='hdrfilm'><integer name='width' value='1'/><integer "
          "name='height' value='1'/><rfilter type='box'/></film>\n"),
    PLAIN("sensor", "distant", MUST "\n"),
    {"sensor", "irradiancemeter",
     "<film type='hdrfilm'><integer name='width' value='1'/><integer "
     "name='height' value='1'/><rfilter type='box'/></film>\n",
     NULL, PATH "<shape type='rectangle'>%</shape>", IMP_RGB},
    PLAIN("sensor", "batch",
          MUST "\n<sensor type='perspective'/>\n<sensor type='perspective'/>\n"),
    PLAIN("film", "hdrfilm", ""),
    {"film", "specfilm", "<spectrum name='a' value='400:1,700:1'/>\n", NULL, NULL,
     IMP_SPECTRAL},
    {"film", "specfilm", "<string name='bins' value='400,700,3'/>\n", NULL, NULL,
     IMP_SPECTRAL},
    PLAIN("sampler", "independent", ""),
    PLAIN("sampler", "stratified", ""),
    PLAIN("integrator", "aov", "<string name='aovs' value='a:depth'/>\n"),
    PLAIN("integrator", "moment", "<integrator type='path'/>\n"),
    {"integrator", "elements", "", NULL,
     EYE "%<shape type='rectangle'><emitter type='area'/></shape>", IMP_RGB},
};

#endif
