/* SPDX-License-Identifier: Apache-2.0
 *
 * Numbers in lanes: a formula is written once, and compiled for one number and for several. Such a
 * text is a header without a guard, about numbers of type `real` and conditions of type `truth`
 * (which & and | join), with the words below; names in WIDE() get the width. It is included once for
 * each width, 1, 4 or 8:
 *
 *     #define IMP_WIDE 4
 *     #define IMP_TEXT "kind/bsdf/conductor_text.h"
 *     #include "math/lane_text.h"      (imp__conductor_4, of four imp_real_4)
 *
 * Lane i of a result has the bits that the text for one number gives for lane i of its arguments:
 * there are sums, products, quotients, roots and bits of numbers alone, and no branches. */
#include "reals.h"

#ifndef IMP_WIDE_JOIN
#define IMP_WIDE_JOIN_(name, width) name##_##width
#define IMP_WIDE_JOIN(name, width)  IMP_WIDE_JOIN_(name, width)
#endif

#define WIDE(name) IMP_WIDE_JOIN(name, IMP_WIDE)
#define real       WIDE(imp_real)
#define truth      WIDE(imp_truth)
#define number     WIDE(imp__real) /* the same in all lanes */
#define whole      WIDE(imp_whole) /* the bits of numbers */
#define whole_of   WIDE(imp__whole_of)
#define real_of    WIDE(imp__real_of)
#define exponent   WIDE(imp__exponent)
#define power_of   WIDE(imp__power)
#define choose     WIDE(imp__choose)
#define root_of    WIDE(imp__root)
#define larger     WIDE(imp__larger)
#define lesser     WIDE(imp__lesser)
#define magnitude  WIDE(imp__magnitude)
#define signed_as  WIDE(imp__signed_as)
#define real3      struct WIDE(imp_real3) /* of vec_text.h, which comes first */
#define inner      WIDE(imp__inner)
#define plus3      WIDE(imp__plus)
#define minus3     WIDE(imp__minus)
#define times3     WIDE(imp__times)
#define choose3    WIDE(imp__choose3)

#include IMP_TEXT

#undef WIDE
#undef real
#undef truth
#undef number
#undef whole
#undef whole_of
#undef real_of
#undef exponent
#undef power_of
#undef choose
#undef root_of
#undef larger
#undef lesser
#undef magnitude
#undef signed_as
#undef real3
#undef inner
#undef plus3
#undef minus3
#undef times3
#undef choose3
#undef IMP_WIDE
#undef IMP_TEXT
