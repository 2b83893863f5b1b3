/* SPDX-License-Identifier: Apache-2.0 */
#include "scene/guide.h"

void imp_guide_destroy(imp_guide *guide)
{
    if (guide) guide->destroy(guide);
}
