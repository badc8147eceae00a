/* Pages of memory. Thread-safe. */
#ifndef BASE_MEMORY_H
#define BASE_MEMORY_H

#include <stddef.h>

/* Asks the system to lay [p, p + bytes), allocated and not touched yet, in large pages as far as they fit: where reads are
 * scattered over much memory, looking up small pages costs as much as reading. A wish: nothing fails. */
void base_memory_large_pages(void *p, size_t bytes);

#endif
