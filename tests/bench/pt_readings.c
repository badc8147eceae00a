/* Processor time of reading against size, as a table: `name;items;bytes;seconds`. scripts/lab bench --only reading draws it.
 *
 *   build/bench/pt_readings [SECONDS]     up to inputs that take about so long (0.3)
 */
#include <stdlib.h>

#include "support/pt_readings.h"

int main(int argc, char **argv) { return base_reading_table(pt_readings, PT_READINGS, argc > 1 ? atof(argv[1]) : 0.3); }
