/* A shared object that is no criterion. */
#include <lull/criterion.h>

LULL_EXPORT int something_else(void);
int something_else(void) { return 1; }
