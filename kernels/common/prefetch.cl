// Hints to CPUs, whose own prefetchers lose the thread where a kernel reads a few channels out of each wide pixel;
// nothing on other devices. Any address will do: a prefetch never faults. CACHE_LINE: REALs in one.
#define CACHE_LINE ((int)(64 / sizeof(REAL)))
#if WIDE && defined(__has_builtin)
#if __has_builtin(__builtin_prefetch)
#define PREFETCH(pointer) __builtin_prefetch((const void*)(size_t)(pointer))
#define PREFETCH_WRITE(pointer) __builtin_prefetch((const void*)(size_t)(pointer), 1)
#endif
#endif
#ifndef PREFETCH
#define PREFETCH(pointer)
#define PREFETCH_WRITE(pointer)
#endif
