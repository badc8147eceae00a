/* SPDX-License-Identifier: MIT
 *
 * A look at a shared object's headers before it is handed to dlopen. Thread safe.
 */
#ifndef LULL_ELF_FILE_H
#define LULL_ELF_FILE_H

/* NULL if the file is an ELF shared object of this machine's class whose segments all lie within the file; else static text
 * that says what is wrong with it. */
const char *lull_elf_file_fault(const char *path);

#endif
