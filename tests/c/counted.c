/* Counters of the core's work; see sc_count.h. */
#include "sc_count.h"

long sc_lookups, sc_root_steps;
