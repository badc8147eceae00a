#include "scene/settings.h"

#include <stddef.h>

#define PT_WORD(id, word) word,
const char *const pt_sampler_words[] = {PT_SAMPLERS(PT_WORD) NULL};
const char *const pt_strategy_words[] = {PT_STRATEGIES(PT_WORD) NULL};
const char *const pt_light_selection_words[] = {PT_LIGHT_SELECTIONS(PT_WORD) NULL};
const char *const pt_filter_words[] = {PT_FILTERS(PT_WORD) NULL};
