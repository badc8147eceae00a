/* The version of the whole project, programs and library of criteria alike. The ABI counts for itself (lull/criterion.h). */
#ifndef BASE_VERSION_H
#define BASE_VERSION_H

#define BASE_VERSION "1.0"

#endif
