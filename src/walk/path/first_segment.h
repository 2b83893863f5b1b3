/* SPDX-License-Identifier: Apache-2.0
 *
 * The kind that the first segment of a walk has. */
#ifndef IMP_WALK_FIRST_SEGMENT_H
#define IMP_WALK_FIRST_SEGMENT_H

#include "walk/core/segment.h"

const struct imp_segment_ops *imp__segment_first(const struct imp_tracer *tracer);

#endif
