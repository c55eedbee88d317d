#define CATCH_CONFIG_RUNNER  // version 2 then defines the session in this file
#include "tests/support/catch.h"

int main(int argc, char** argv) {
  return Catch::Session().run(argc, argv);
}
