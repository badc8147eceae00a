/*
 * Serves a study over HTTP until told to stop. One thread answers all requests and must never wait for the disk to sync
 * (ggn_study_store_sync_behind); nothing outside is ever asked for anything.
 */
#ifndef GGN_STUDY_SERVER_H
#define GGN_STUDY_SERVER_H

#include <signal.h>

#include "study/api.h"

struct ggn_study_address { /* of --listen: ADDR, ADDR:PORT, [ADDR6] or [ADDR6]:PORT */
    char host[64];
    int port; /* 0: any that is free */
    int ipv6, loopback;
};

enum { GGN_STUDY_PORT = 8737 };

/* Numbers only, no names: nothing is looked up. */
int ggn_study_address_parse(const char *text, struct ggn_study_address *address, struct base_err *err);

/* Prints the link on stdout once it answers, refusals on stderr, and returns when *stop is set or the store
 * cannot be synced any more (both checked ten times a second).
 * site->hosts is ignored: on a loopback address it is the address itself, else anything, since then there is a token. */
int ggn_study_serve(const struct ggn_study_site *site, const struct ggn_study_address *address,
                    const volatile sig_atomic_t *stop, struct base_err *err);

#endif
