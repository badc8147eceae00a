/* Starts a thread when it is loaded, as OpenBLAS does unless told not to. */
#include "stub.h"

#include <pthread.h>
#include <unistd.h>

static const struct lull_criterion stub = STUB("thread-on-load");

static void *sleeper(void *arg)
{
    pause();
    return arg;
}

__attribute__((constructor)) static void loaded(void)
{
    pthread_t thread;
    if (pthread_create(&thread, NULL, sleeper, NULL) == 0)
        pthread_detach(thread);
}

const struct lull_criterion *lull_criterion_entry_v1(uint32_t index) { return index == 0 ? &stub : NULL; }
