/* Texts of other people's programs in recorded outputs. */
#ifndef TESTS_SUPPORT_FOREIGN_H
#define TESTS_SUPPORT_FOREIGN_H

/* The text with what strerror says here replaced by what it said where outputs were recorded; malloc'ed. */
char *foreign_as_recorded(const char *text);

#endif
