/* SPDX-License-Identifier: Apache-2.0 */
#include "shape.h"

const struct imp_shape_ops *const imp__shape_kinds[] = {
    &imp__rectangle, &imp__disk, &imp__sphere, &imp__cylinder,
    &imp__cube, &imp__mesh, &imp__obj, &imp__ply, NULL};
