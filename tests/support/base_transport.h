/* Processes that are threads of the test: job/transport.h over queues in memory, for jobs without MPI, under any sanitizer. */
#ifndef TESTS_SUPPORT_BASE_TRANSPORT_H
#define TESTS_SUPPORT_BASE_TRANSPORT_H

#include "job/transport.h"

enum { BASE_TRANSPORT_MAX = 8 };

struct base_transport;

/* count <= BASE_TRANSPORT_MAX processes on "here"; each belongs to one thread. Released, with what nobody received, by
 * base_transport_destroy. */
struct base_transport *base_transport_create(int count);
struct job_transport *base_transport_of(struct base_transport *transport, int rank);
/* Who a process is, to be changed before anybody has opened it. */
struct job_process *base_transport_process(struct base_transport *transport, int rank);
/* How often abort was called, by anybody. */
int base_transport_aborted(struct base_transport *transport);
/* From now on rank 0 calls nothing_came(data) whenever it looks for a message and there is none. */
void base_transport_listen(struct base_transport *transport, void (*nothing_came)(void *data), void *data);
void base_transport_destroy(struct base_transport *transport);

#endif
