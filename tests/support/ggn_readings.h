/* What ggn reads besides sequences: models, labels, tables of thresholds. */
#ifndef TESTS_SUPPORT_GGN_READINGS_H
#define TESTS_SUPPORT_GGN_READINGS_H

#include "support/base_reading.h"

enum { GGN_READINGS = 3 };
extern const struct base_reading ggn_readings[GGN_READINGS];

#endif
