// Scalar and vector types of the build.
// -D REAL=float|double, REAL_IS_DOUBLE=0|1, V=1|2|4|8|16 (vector width), WIDE=0|1 (parameter set).
// REALV is REAL when V is 1, so that scalar builds compile to plain scalar code.
#if REAL_IS_DOUBLE
#pragma OPENCL EXTENSION cl_khr_fp64 : enable
#endif
#define JOIN_TOKENS(a, b) a##b
#define JOIN(a, b) JOIN_TOKENS(a, b)
#if V == 1
#define REALV REAL
#define INTV int
#define LOAD_VECTOR(index, pointer) ((pointer)[index])
#define STORE_VECTOR(value, index, pointer) ((pointer)[index] = (value))
#else
#define REALV JOIN(REAL, V)
#define INTV JOIN(int, V)
#define LOAD_VECTOR(index, pointer) JOIN(vload, V)(index, pointer)
#define STORE_VECTOR(value, index, pointer) JOIN(vstore, V)(value, index, pointer)
#endif
#define REAL3 JOIN(REAL, 3)
#define REAL4 JOIN(REAL, 4)
