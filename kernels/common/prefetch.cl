// Hints to CPUs, whose own prefetchers lose the thread where a kernel reads a few channels out of each wide pixel;
// nothing on other devices. Any address will do: a prefetch never faults. CACHE_LINE: REALs in one.
// -D NO_PREFETCH: none at all, for simulators that know no such instruction.
#define CACHE_LINE ((int)(64 / sizeof(REAL)))
#if WIDE && !defined(NO_PREFETCH) && defined(__has_builtin)
#if __has_builtin(__builtin_prefetch)
#define PREFETCH(pointer) __builtin_prefetch((const void*)(size_t)(pointer))
#define PREFETCH_WRITE(pointer) __builtin_prefetch((const void*)(size_t)(pointer), 1)
#endif
#endif
#ifndef PREFETCH
#define PREFETCH(pointer)
#define PREFETCH_WRITE(pointer)
#endif

// Stores a whole vector past the caches where STREAM is 1: what is too large to stay there until it is read need not be
// fetched before it is overwritten. pointer: aligned to the vector's size.
#if V > 1 && STREAM && WIDE && defined(__has_builtin)
#if __has_builtin(__builtin_nontemporal_store)
#define STREAM_VECTOR(value, pointer) __builtin_nontemporal_store(value, (global REALV*)(pointer))
#endif
#endif
