/* The peers of base/peers.h over MPI 3, in a shared object of its own that only processes started by a launcher load. */
#ifndef MPI_PEERS_MPI_H
#define MPI_PEERS_MPI_H

#include "base/peers.h"

__attribute__((visibility("default"))) int base_peers_open_mpi(struct base_peers **out, struct base_err *err);
__attribute__((visibility("default"))) const char *base_peers_version_mpi(void);

#endif
