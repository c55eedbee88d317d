#pragma once

#include <string>
#include <vector>

#include "model/study/study_runner.h"

namespace degas {

/// As --kernels and --tune take it.
const char* option_word(KernelSet set);
const char* option_word(TuneMode mode);

/// Options that the commands of training, fitting and evaluation share.
std::vector<std::string> shared_words(const StudySetup& setup);

/// "degas ..." as a shell takes it: by which anyone can do the same.
std::string command_text(const std::vector<std::string>& words);

}  // namespace degas
