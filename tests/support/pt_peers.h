/* Processes that are threads of the test: base/peers.h over queues in memory, for the crew without MPI, under any sanitizer. */
#ifndef TESTS_SUPPORT_PT_PEERS_H
#define TESTS_SUPPORT_PT_PEERS_H

#include "base/peers.h"

enum { PT_PEERS_MAX = 8 };

struct pt_peers_room;

/* count <= PT_PEERS_MAX peers; each belongs to one thread. Released, with what nobody received, by pt_peers_destroy. */
struct pt_peers_room *pt_peers_create(int count);
struct base_peers *pt_peers_of(struct pt_peers_room *room, int rank);
/* How often abort was called, by anybody. */
int pt_peers_aborted(struct pt_peers_room *room);
void pt_peers_destroy(struct pt_peers_room *room);

#endif
