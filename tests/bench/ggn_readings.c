/* Processor time of reading against size, as a table: `name;items;bytes;seconds`. scripts/lab bench --only reading draws it.
 *
 *   build/bench/ggn_readings [SECONDS]     up to inputs that take about so long (0.3)
 */
#include <stdlib.h>

#include "support/ggn_readings.h"

int main(int argc, char **argv) { return base_reading_table(ggn_readings, GGN_READINGS, argc > 1 ? atof(argv[1]) : 0.3); }
