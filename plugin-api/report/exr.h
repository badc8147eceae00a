/* The report of a render of which only the picture was kept: from its layers lull.… and attributes lull:…. */
#ifndef REPORT_EXR_H
#define REPORT_EXR_H

#include "base/err.h"

/* *report: JSON as lull_host_page takes it, the caller's; NULL after a failure. It has what the picture knows: blocks cut to
 * the stored pixels, without times and checks. Errors as of picture/read.h; BASE_EINVAL also when layers are missing, or
 * layers and attributes contradict each other. */
int report_from_exr(const char *path, char **report, struct base_err *err);

#endif
