#define _DEFAULT_SOURCE 1 /* MAP_ANONYMOUS */
#include "baselines/blas.h"

#include <dlfcn.h>
#include <pthread.h>
#include <semaphore.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>

#include "base/module.h"
#include "base/threads.h"

enum { CALLS_MOST = 64 };

static struct {
    __typeof__(cblas_sgemm) *sgemm;
    __typeof__(openblas_set_num_threads) *set_threads;
    /* LAPACK's, by the calling convention of Fortran: behind the arguments the lengths of the words. */
    void (*dgesvd)(const char *jobu, const char *jobvt, const int *m, const int *n, double *a, const int *lda, double *s,
                   double *u, const int *ldu, double *vt, const int *ldvt, double *work, const int *lwork, int *info,
                   size_t jobu_length, size_t jobvt_length);
    void *(*take)(int position); /* its own memory of a call; it keeps what is given back */
    void (*give)(void *memory);
} blas;

static pthread_once_t once = PTHREAD_ONCE_INIT;
static struct base_err reason;
static sem_t calls; /* that may run at a time */

static int has_room(size_t megabytes)
{
    void *room = mmap(NULL, megabytes << 20, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
    return room != MAP_FAILED && munmap(room, megabytes << 20) == 0;
}

static int find(void *library, const char *name, void *function)
{
    void *symbol = library ? dlsym(library, name) : NULL;
    memcpy(function, &symbol, sizeof symbol); /* a pointer to data into one to a function */
    return symbol != NULL;
}

static void load_library(void)
{
    static const char file[] = "libopenblas.so.0", variable[] = "OPENBLAS_NUM_THREADS";
    const int chosen = getenv(variable) != NULL;
    if (!chosen)
        setenv(variable, "1", 1);
    void *library = base_module_open(file, RTLD_NOW | RTLD_LOCAL, &reason);
    if (!chosen)
        unsetenv(variable);
    if (!library)
        return;
    if (!find(library, "cblas_sgemm", &blas.sgemm) || !find(library, "openblas_set_num_threads", &blas.set_threads) ||
        !find(library, "dgesvd_", &blas.dgesvd) || !find(library, "blas_memory_alloc", &blas.take) ||
        !find(library, "blas_memory_free", &blas.give))
        base_fail(&reason, BASE_EIO, "%s: it lacks one of the functions that are used", file);
    else
        blas.set_threads(1);
}

/* Takes what each of so many calls works in, as far as there is room; at least one. */
static void load(void)
{
    const size_t library_mb = 64, call_mb = 130;
    const int processors = base_threads_available(), most = processors < CALLS_MOST ? processors : CALLS_MOST;
    void *memory[CALLS_MOST];
    int n = 0;
    if (!has_room(library_mb + call_mb)) {
        base_fail_nomem(&reason, "OpenBLAS");
        return;
    }
    load_library();
    if (reason.code)
        return;
    while (n < most && has_room(call_mb))
        memory[n++] = blas.take(0);
    if (n == 0 || sem_init(&calls, 0, (unsigned)n) != 0)
        base_fail_nomem(&reason, "OpenBLAS");
    while (n > 0)
        blas.give(memory[--n]);
}

int ggn_blas_open(struct base_err *err)
{
    pthread_once(&once, load);
    return reason.code ? base_fail(err, reason.code, "%s", reason.text) : 0;
}

static void enter(void)
{
    while (sem_wait(&calls) != 0) /* a signal came */
        continue;
}

void ggn_blas_sgemm(enum CBLAS_TRANSPOSE ta, enum CBLAS_TRANSPOSE tb, int m, int n, int k, const float *a, const float *b,
                    float beta, float *c)
{
    enter();
    blas.sgemm(CblasRowMajor, ta, tb, m, n, k, 1.0f, a, ta == CblasNoTrans ? k : m, b, tb == CblasNoTrans ? n : k, beta, c,
               n);
    sem_post(&calls);
}

int ggn_blas_singular_values(int n, double *a, double *s, double *work)
{
    const int one = 1, room = 64 * n;
    int info = 0;
    enter();
    blas.dgesvd("N", "N", &n, &n, a, &n, s, NULL, &one, NULL, &one, work, &room, &info, 1, 1);
    sem_post(&calls);
    return info;
}

void ggn_blas_threads(int count) { blas.set_threads(count); }
