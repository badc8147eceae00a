#include "plugin/criteria.h"

GP_ENTRY(&ggn_plugin_denoised)
