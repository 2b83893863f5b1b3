/* SPDX-License-Identifier: Apache-2.0
 *
 * Walks in bundles through media of uniform extinction beside the same walks alone (bundle_kit.h). */
#include "bundle_kit.h"

#define VOLPATH(rest) "<integrator type='volpath'>" rest "</integrator>"
#define MEDIUM(id, sigma, albedo, phase)                                                 \
    "<medium type='homogeneous' id='" id "'><rgb name='sigma_t' value='" sigma           \
    "'/><rgb name='albedo' value='" albedo "'/>" phase "</medium>"
#define HG(g)           "<phase type='hg'><float name='g' value='" g "'/></phase>"
#define HOLDS(id, bsdf) "<bsdf type='" bsdf "'/><ref name='interior' id='" id "'/>"

/* Walks through media of uniform extinction. */
static void media(void)
{
    static char rest[8192];
    compare("a slab of three colours", IMP_RGB, 1, VOLPATH(DEPTH("40") RR("8")), CAMERA,
            MEDIUM("m", "1,2,4", ".98,.9,.8", HG(".6")) SKY LAMP("0", "0", ".5")
                CUBE("0", "0", HOLDS("m", "null"))
                    CUBE("-.6", "-1.2", DIFFUSE(".9,.5,.1")));
    compare("independent walks in a slab", IMP_RGB, 0, VOLPATH(DEPTH("9")), CAMERA,
            MEDIUM("m", "1,2,4", ".98,0,.8", "") LAMP("0", "0", ".5")
                CUBE("0", "0", HOLDS("m", "null")) SKY);
    compare("a slab in grey", IMP_MONO, 1, VOLPATH(DEPTH("12")), CAMERA,
            MEDIUM("m", "3,3,3", ".9,.9,.9", HG("-.3")) LAMP("0", "0", ".5")
                CUBE("0", "0", HOLDS("m", "null"))
                    CUBE("-.6", "-1.2", DIFFUSE(".9,.9,.9")) SKY);
    /* Boundaries that bend, a medium within a medium, one that only absorbs, and phase functions
     * without a form in lanes. */
    snprintf(rest, sizeof rest, "%s%s",
             MEDIUM("wax", "6,7,9", ".99,.96,.85", HG(".5"))
                 MEDIUM("tea", "2,0,3", "0,0,0", "")
                     MEDIUM("air", "1,1,1", ".9,.8,.7", "<phase type='rayleigh'/>"),
             ROOM LAMP("0", "0", ".5") BALL("-.7", ".4", HOLDS("wax", "dielectric")) BALL(
                 "1", ".4", HOLDS("tea", "roughdielectric"))
                 CUBE(".2", "-.9", HOLDS("air", "null")) "<shape type='cube'>" AT(
                     ".2", "-.9", ".3", "y", "30", ".2")
                     HOLDS("wax", "null") "<ref name='exterior' id='air'/></shape>" CUBE(
                         "-.9", "-1.2", DIFFUSE(".9,.2,0")));
    compare("wax, tea and air", IMP_RGB, 8, VOLPATH(DEPTH("30") RR("6")), CAMERA, rest);
    strcat(rest, SKY);
    compare("wax, tea and air, and a sky", IMP_RGB, 8, VOLPATH(DEPTH("7")), CAMERA, rest);
    compare("a fog that fills the room", IMP_RGB, 6, VOLPATH(DEPTH("8")),
            CAMERA "<ref id='fog'/>",
            MEDIUM("fog", ".2,.3,.4", ".9,.9,.9", HG(".7")) "<shape type='rectangle'>" AT(
                "0", "-2", "0", "x", "-90", "2")
                DIFFUSE(".7,.6,.5") "<ref name='exterior' id='fog'/></shape>" WALL(
                    "0", "2", "0", "x", "90", DIFFUSE(".6,.7,.8"))
                    WALL("-2", "0", "0", "y", "90", DIFFUSE(".8,.1,.1"))
                        WALL("2", "0", "0", "y", "-90", DIFFUSE(".1,.8,.2"))
                            WALL("0", "0", "-2", "y", "0", DIFFUSE(".5,.5,.5"))
                                LAMP("0", "0", ".5")
                                    CUBE("-.6", "-1.2", DIFFUSE(".9,.9,.9")));
    compare("no medium", IMP_RGB, 6, VOLPATH(DEPTH("5")), CAMERA,
            ROOM LAMP("0", "0", ".5") CUBE("-.6", "-1.2", DIFFUSE(".9,.2,0")));
    compare("clipped, in fog", IMP_RGB, 1, VOLPATH(DEPTH("5")),
            "perspective'><float name='near_clip' value='1.5'/><float name='far_clip' "
            "value='5'/><ref id='fog'/>" VIEW,
            MEDIUM("fog", ".2,.3,.4", ".9,.9,.9", HG(".7")) SKY LAMP("0", "0", ".5")
                CUBE("-.6", "-.2", DIFFUSE(".9,.9,.9")));
    compare("lamps by a tree, in fog", IMP_RGB, 1,
            VOLPATH(DEPTH("5") "<string name='light_choice' value='tree'/>"),
            CAMERA "<ref id='fog'/>",
            MEDIUM("fog", ".2,.3,.4", ".9,.9,.9", HG(".7")) LAMP("0", "0", ".5")
                LAMP("1", "0", ".2") LAMP("-1", "0", ".2")
                    CUBE("-.6", "-.2", DIFFUSE(".9,.9,.9")));
}

int main(void)
{
    ctx = test_context(1);
    media();
    imp_context_destroy(ctx);
    return tap_done();
}
