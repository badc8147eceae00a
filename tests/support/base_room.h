/* Processes that are threads of the test: base/peers.h over queues in memory, for the crew without MPI, under any sanitizer. */
#ifndef TESTS_SUPPORT_BASE_ROOM_H
#define TESTS_SUPPORT_BASE_ROOM_H

#include "base/peers.h"

enum { BASE_ROOM_MAX = 8 };

struct base_room;

/* count <= BASE_ROOM_MAX peers; each belongs to one thread. Released, with what nobody received, by base_room_destroy. */
struct base_room *base_room_create(int count);
struct base_peers *base_room_of(struct base_room *room, int rank);
/* How often abort was called, by anybody. */
int base_room_aborted(struct base_room *room);
/* How often anybody has waited for a letter, for the whole time it wished, and none came. */
int base_room_in_vain(struct base_room *room);
void base_room_destroy(struct base_room *room);

#endif
