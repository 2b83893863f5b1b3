/* SPDX-License-Identifier: Apache-2.0
 *
 * Sensors of the scene as options name them: by name, or by number from 0. */
#ifndef IMP_CLI_SENSOR_NAMES_H
#define IMP_CLI_SENSOR_NAMES_H

#include <stddef.h>

int sensor_count(void);
/* The sensor of this name; -1: there is none. */
int sensor_named(const char *name, size_t length);
/* By name, else by number; -1: the scene has neither. */
int sensor_find(const char *text);
/* "a, b, c", as far as they have room. */
void sensor_names(char *text, size_t size);
/* --sensor into cli.sensor. 0, or 2 with the reason. */
int sensor_set(const char *text);

#endif
