/* SPDX-License-Identifier: Apache-2.0
 *
 * The bytes of a scene (tree_file.h): each building call is a mark with what it takes. */
#ifndef IMP_FORMAT_TREE_MARKS_H
#define IMP_FORMAT_TREE_MARKS_H

/* What comes next; a text is its length and its bytes, NULL has the length UINT32_MAX. */
enum imp__tree_mark {
    MARK_END, /* of the object; of the scene, the last byte */
    MARK_BEGIN,
    MARK_BOOL,
    MARK_INTEGER,
    MARK_FLOAT,
    MARK_STRING,
    MARK_VECTOR,
    MARK_RGB,
    MARK_SPECTRUM,
    MARK_TRANSFORM,
    MARK_REF,
    MARK_IMAGE,
    MARK_MESH,
    MARK_IES,
    MARK_MERL,
    MARK_GRID,
    MARK_MEASURED
};
#define IMP_TREE_TEXT_MAX ((size_t)1 << 16)

#endif
