#include "study/syncer.h"

#include <errno.h>
#include <fcntl.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

struct ggn_study_syncer {
    pthread_mutex_t lock; /* of wanted, stop and failure */
    pthread_cond_t asked;
    pthread_t thread;
    int wanted, stop;
    int failure; /* errno of a sync; 0: none failed */
    int fd;
    char path[4096];
};

static void *syncer_main(void *data)
{
    struct ggn_study_syncer *s = data;
    pthread_mutex_lock(&s->lock);
    while (!s->failure && (s->wanted || !s->stop)) {
        if (!s->wanted) {
            pthread_cond_wait(&s->asked, &s->lock);
            continue;
        }
        s->wanted = 0;
        pthread_mutex_unlock(&s->lock);
        int failure = fdatasync(s->fd) == 0 ? 0 : errno;
        pthread_mutex_lock(&s->lock);
        s->failure = failure;
    }
    pthread_mutex_unlock(&s->lock);
    return NULL;
}

int ggn_study_syncer_start(const char *path, struct ggn_study_syncer **syncer, struct base_err *err)
{
    struct ggn_study_syncer *s = calloc(1, sizeof *s);
    if (!s)
        return base_fail_nomem(err, path);
    snprintf(s->path, sizeof s->path, "%s", path);
    s->fd = open(path, O_RDWR | O_CLOEXEC);
    int failure = s->fd >= 0 ? 0 : errno;
    pthread_mutex_init(&s->lock, NULL);
    pthread_cond_init(&s->asked, NULL);
    if (!failure)
        failure = pthread_create(&s->thread, NULL, syncer_main, s);
    if (failure) {
        if (s->fd >= 0)
            close(s->fd);
        free(s);
        return base_fail(err, BASE_EIO, "%s: cannot be synced: %s", path, strerror(failure));
    }
    *syncer = s;
    return 0;
}

void ggn_study_syncer_want(struct ggn_study_syncer *s)
{
    pthread_mutex_lock(&s->lock);
    s->wanted = 1;
    pthread_cond_signal(&s->asked);
    pthread_mutex_unlock(&s->lock);
}

int ggn_study_syncer_check(struct ggn_study_syncer *s, struct base_err *err)
{
    pthread_mutex_lock(&s->lock);
    int failure = s->failure;
    pthread_mutex_unlock(&s->lock);
    if (!failure)
        return 0;
    return base_fail(err, BASE_EIO, "%s: the latest answers may not be on the disk: %s", s->path, strerror(failure));
}

void ggn_study_syncer_stop(struct ggn_study_syncer *s)
{
    if (!s)
        return;
    pthread_mutex_lock(&s->lock);
    s->stop = 1;
    pthread_cond_signal(&s->asked);
    pthread_mutex_unlock(&s->lock);
    pthread_join(s->thread, NULL);
    pthread_cond_destroy(&s->asked);
    pthread_mutex_destroy(&s->lock);
    close(s->fd);
    free(s);
}
