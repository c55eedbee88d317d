#include "model/study/recorded_command.h"

namespace degas {
namespace {

std::string quoted(const std::string& word) {
  const bool plain = !word.empty() && word.find_first_not_of(
                                          "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ"
                                          "0123456789._-+=,:/@%") == std::string::npos;
  if (plain) return word;
  std::string text = "'";
  for (const char c : word) text += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return text + "'";
}

}  // namespace

const char* option_word(KernelSet set) {
  return set == KernelSet::Gpu ? "gpu" : "wide";
}

const char* option_word(TuneMode mode) {
  return mode == TuneMode::Off ? "off" : mode == TuneMode::Fast ? "fast" : "full";
}

std::vector<std::string> shared_words(const StudySetup& setup) {
  std::vector<std::string> words;
  if (!setup.capture.format.empty()) words.insert(words.end(), {"--format", setup.capture.format});
  if (!setup.device.selector.empty()) words.insert(words.end(), {"--device", setup.device.selector});
  if (setup.device.kernel_set) words.insert(words.end(), {"--kernels", option_word(*setup.device.kernel_set)});
  if (setup.tune != TuneMode::Off) words.insert(words.end(), {"--tune", option_word(setup.tune)});
  return words;
}

std::string command_text(const std::vector<std::string>& words) {
  std::string text = "degas";
  for (const std::string& word : words) text += ' ' + quoted(word);
  return text;
}

}  // namespace degas
