/* A text of lines key=value as the identity of a render, with the roles that options of lull-render have. */
#ifndef SUPPORT_PT_IDENTITY_H
#define SUPPORT_PT_IDENTITY_H

#include <string.h>

#include "render/render.h"

#define PT_IDENTITY(lines) \
    (&(const struct base_identity){ \
        .text = (char *)(size_t)(lines), \
        .size = strlen(lines), \
        .roles = { \
            {"spp-max", PT_ROLE_END}, {"spp-min", PT_ROLE_LIMIT}, {"max-seam", PT_ROLE_LIMIT}, {"param", PT_ROLE_RULE}}})

#endif
