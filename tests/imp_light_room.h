/* SPDX-License-Identifier: Apache-2.0
 *
 * Pieces of the rooms in which bidirectional walks are compared. */
#ifndef IMP_LIGHT_ROOM_H
#define IMP_LIGHT_ROOM_H

/* clang-format off: literals are broken where the markup is */
#define AT(t) "<transform name='to_world'>" t "</transform>"
#define BALL(x, bsdf)                                                                    \
    "<shape type='sphere'><float name='radius' value='.6'/><point name='center' "        \
    "value='" x "'/>" bsdf "</shape>"
#define FOG                                                                              \
    "<shape type='cube'>" AT(                                                            \
        "<scale value='.7'/><translate x='.9' y='-.9' z='.4'/>") "<bsdf "                \
                                                                 "type='null'/><medium " \
                                                                 "name='interior' "      \
                                                                 "type='homogeneous'>"   \
                                                                 "<rgb name='sigma_t' "  \
                                                                 "value='1,1.5,2'/"      \
                                                                 "><rgb name='albedo' "  \
                                                                 "value='.8,.7,.6'/>"    \
                                                                 "<phase "               \
                                                                 "type='hg'><float "     \
                                                                 "name='g' "             \
                                                                 "value='.4'/></"        \
                                                                 "phase></medium></"     \
                                                                 "shape>"
/* clang-format on */

#endif
