/* What a step does, counted: tests that define SC_COUNT_WORK, and these two, bound it by that. */
#ifndef SC_COUNT_H
#define SC_COUNT_H

#ifdef SC_COUNT_WORK
extern long sc_lookups;    /* intervals of tables, each with its search */
extern long sc_root_steps; /* steps of Newton's method inside an interval */
#define SC_COUNT(what) ((what)++)
#else
#define SC_COUNT(what) ((void)0)
#endif

#endif
