/* What every process of a job must agree about before work begins. */
#ifndef PT_AGREE_H
#define PT_AGREE_H

#include "open.h"

enum { PT_AGREE_JOB = sizeof((struct pt_open *)0)->settings + 128 }; /* room for the text of a job */

/* Of one file. */
int pt_agree_crc(const char *path, uint32_t *crc, struct base_err *err);
/* The settings and the model that the criterion starts with; text [room], room PT_AGREE_JOB. */
int pt_agree_job(const struct pt_open *open, char *text, size_t room, struct base_err *err);
/* Every process of a job, ready to begin: rank 0 waits for all and refuses those that differ. Nothing without a job. */
int pt_agree_handshake(const struct pt_open *open, struct job *job, struct base_err *err);

#endif
