// Runs the tests of one folder.
#include <gmock/gmock.h>

#include "common/parallel/all_cores.h"

int main(int argc, char** argv) {
  ::testing::InitGoogleMock(&argc, argv);
  const intervale::AllCores all_cores;
  return RUN_ALL_TESTS();
}
