#include "base/peers.h"

#include <errno.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/module.h"
#include "base/threads.h"

/* The implementation's one symbol. */
typedef int open_fn(struct base_peers **out, struct base_err *err);
static const char MODULE[] = "lull-mpi.so";

/* What launchers leave in the environment: Open MPI, any with PMIx, MPICH and Slurm. */
static int was_launched(void)
{
    static const char *const marks[] = {"OMPI_COMM_WORLD_RANK", "PMIX_RANK", "PMI_RANK"};
    for (size_t i = 0; i < sizeof marks / sizeof marks[0]; i++)
        if (getenv(marks[i]))
            return 1;
    return 0;
}

static int launched_alone(void)
{
    const char *count = getenv("OMPI_COMM_WORLD_SIZE");
    count = count ? count : getenv("PMI_SIZE");
    return count && strcmp(count, "1") == 0;
}

int base_peers_open(struct base_peers **out, struct base_err *err)
{
    open_fn *open = NULL;
    *out = NULL;
    if (!was_launched() || launched_alone())
        return 0;
    void *symbol = base_module_symbol(MODULE, "base_peers_open_mpi", 1); /* MPI libraries load parts of themselves */
    memcpy(&open, &symbol, sizeof open);
    if (!open)
        return base_fail(err, BASE_EINVAL,
                         "started by an MPI launcher, but this program has no MPI (its lib/lull-mpi.so): "
                         "build it with MPI installed, or start it without the launcher");
    return open(out, err);
}

void base_peers_close(struct base_peers *peers)
{
    if (peers)
        peers->calls->close(peers);
}

void base_peers_abort(struct base_peers *peers, int status) { peers->calls->abort(peers, status); }

int base_peers_send(struct base_peers *peers, int rank, void *data, size_t size, struct base_err *err)
{
    return peers->calls->send(peers, rank, data, size, err);
}

int base_peers_receive(struct base_peers *peers, double wait_s, int *rank, void **data, size_t *size, struct base_err *err)
{
    return peers->calls->receive(peers, wait_s, rank, data, size, err);
}

static int same_host(const struct base_peers *peers, int rank)
{
    return strcmp(peers->list[rank].host, peers->list[peers->rank].host) == 0;
}

int base_peers_threads(const struct base_peers *peers)
{
    int available = base_threads_available(), processes = 0;
    if (!peers)
        return available;
    for (int i = 0; i < peers->count; i++)
        processes += same_host(peers, i);
    long share = sysconf(_SC_NPROCESSORS_ONLN) / processes;
    return share < 1 ? 1 : share < available ? (int)share : available;
}

int base_peers_mourn(const struct base_peers *peers, struct base_err *err)
{
    for (int i = 0; i < peers->count; i++)
        if (same_host(peers, i) && kill((pid_t)peers->list[i].pid, 0) != 0 && errno == ESRCH)
            return base_fail(err, BASE_EIO, "%s has died", peers->list[i].name);
    return 0;
}

int base_peers_give_up(const struct base_peers *peers, int rank, double timeout_s, struct base_err *err)
{
    return base_fail(err, BASE_EIO, "%s has not answered for %g s (--rank-timeout)", peers->list[rank].name, timeout_s);
}

int base_peers_differ(const struct base_peers *peers, int rank, const char *theirs, const char *ours, struct base_err *err)
{
    const char *name = peers->list[rank].name;
    while (*theirs != '\0' && *ours != '\0') {
        int a = (int)strcspn(theirs, "\n"), b = (int)strcspn(ours, "\n");
        if (a != b || memcmp(theirs, ours, (size_t)a) != 0)
            return base_fail(err, BASE_EINVAL, "%s has %.*s, but rank 0 has %.*s: give all hosts the same files", name, a,
                             theirs, b, ours);
        theirs += a + (theirs[a] != '\0');
        ours += b + (ours[b] != '\0');
    }
    return base_fail(err, BASE_EINVAL, "%s has other settings than rank 0", name);
}

const char *base_peers_version(void)
{
    const char *(*version)(void) = NULL;
    void *symbol = base_module_symbol(MODULE, "base_peers_version_mpi", 1);
    memcpy(&version, &symbol, sizeof version);
    return version ? version() : "none (built without it)";
}
