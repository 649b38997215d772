#define _GNU_SOURCE

#include "sc_rights.h"

#if defined(_WIN32)

int sc_rights_lock_memory(void)
{
    return 0;
}

#else

#include <sys/mman.h>

int sc_rights_lock_memory(void)
{
    return mlockall(MCL_CURRENT | MCL_FUTURE) == 0;
}

#endif

#if defined(__linux__)
#include <string.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>
#endif

#if defined(__linux__) && defined(SYS_sched_setattr)

/* As in linux/sched/types.h, first version; not all systems have that header. */
typedef struct {
    uint32_t size;
    uint32_t policy; /* 0: SCHED_OTHER */
    uint64_t flags;
    int32_t nice;
    uint32_t priority;
    uint64_t runtime_ns;
    uint64_t deadline_ns;
    uint64_t period_ns;
} attributes;

int sc_rights_slice(uint32_t slice_us)
{
    attributes wanted;
    memset(&wanted, 0, sizeof wanted);
    wanted.size = sizeof wanted;
    wanted.nice = getpriority(PRIO_PROCESS, 0);
    wanted.runtime_ns = (uint64_t)slice_us * 1000u;
    return syscall(SYS_sched_setattr, 0, &wanted, 0u) == 0;
}

#else

int sc_rights_slice(uint32_t slice_us)
{
    (void)slice_us;
    return 0;
}

#endif
