/*
 * What a study answers to a request, without sockets: files of the page, stimuli, and the JSON of people and trials.
 *
 * The addresses, all relative to the study's link (which ends in '/', after the token if there is one):
 *     GET  (nothing), FILE, vendor/FILE    the page
 *     GET  texts.json                      what the page says
 *     GET  stimuli/vVIEW/FILE.png
 *     GET  api/study                       the study file
 *     POST api/people                      {"consent": true} → {"key", "id"}
 *     GET  api/people/KEY                  {"id", "profile", "slots": […], "trials": […]}
 *     POST api/people/KEY/profile          an object: what they told and measured
 *     POST api/people/KEY/trials           {"slot", "revision", "level", "answer", "rating", "ms", "layout"}
 * Nothing is changed unless all of the body is right. A trial that is there already is acknowledged again, so a page may
 * repeat what it did not hear about; a different one in its place is refused with 409. One thread.
 */
#ifndef GGN_STUDY_API_H
#define GGN_STUDY_API_H

#include "study/store.h"
#include "study/study.h"

enum { GGN_STUDY_BODY_MAX = 65536 };

struct ggn_study_site {         /* all borrowed */
    const char *dir, *page_dir; /* the study's folder; the page's */
    const char *token;          /* first part of every address; NULL: none */
    const char *const *hosts;   /* what the Host header may say, NULL at the end; NULL: anything */
    const struct ggn_study *study;
    struct ggn_study_store *store;
};

struct ggn_study_request {     /* headers are NULL when not sent */
    const char *method, *path; /* path: as sent, starts with '/', without the query */
    const char *host, *origin, *fetch_site, *content_type;
    const char *body;
    size_t size; /* bytes of body, at most GGN_STUDY_BODY_MAX */
};

struct ggn_study_response {
    int status;       /* HTTP */
    const char *type; /* media type */
    int fd;           /* an open file to send, owned by the caller; -1: `body` */
    char *body;       /* malloc, owned by the caller */
    size_t size;      /* bytes of body, or of the file */
    int keep;         /* whether a browser may keep it for ever */
    char why[256];    /* for the log when the request was refused; else empty */
};

/* Always gives a response. */
void ggn_study_answer(const struct ggn_study_site *site, const struct ggn_study_request *request,
                      struct ggn_study_response *response);
/* A refusal in the same form, for what goes wrong before a request is whole. */
void ggn_study_refuse(struct ggn_study_response *response, int status, const char *why);

#endif
