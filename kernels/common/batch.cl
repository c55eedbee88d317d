// Many arrays in one launch: most parameters of a network are so small that a launch each would cost more than the
// work. A batch is up to BATCH of them, their blocks one after the other, a work-group a block. Kernels take arguments
// for every array, EACH(DECLARE), and a work-group tells its own by IS_OF. With four arrays each and a structure of
// numbers the arguments stay below the 1024 bytes that every device takes.
#define BATCH 16
#define EACH(WHAT)                                                                          \
  WHAT(0) WHAT(1) WHAT(2) WHAT(3) WHAT(4) WHAT(5) WHAT(6) WHAT(7) WHAT(8) WHAT(9) WHAT(10) \
  WHAT(11) WHAT(12) WHAT(13) WHAT(14) WHAT(15)

// Whether `block` is the k-th array's or a later one's. batch.ends: blocks of each array and of those before it; of all
// where there are fewer arrays.
#define IS_OF(k) (block >= ((k) == 0 ? 0 : batch.ends[max((k)-1, 0)]))
