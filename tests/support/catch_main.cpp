#define CATCH_CONFIG_RUNNER  // version 2 then defines the session in this file
#include "tests/support/catch.h"

int main(int argc, char** argv) {
  return Catch::Session().run(argc, argv);
}

#ifdef __SANITIZE_THREAD__
// FFmpeg's frames go from its decoding threads to ours by atomics that the sanitizer, which sees our code alone, misses.
extern "C" const char* __tsan_default_suppressions() {
  return "race:libavutil.so\n";
}
#endif
