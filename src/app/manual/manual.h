// SPDX-License-Identifier: MIT
// What is installed beside the program for people and their shells, as text. All of it is made of the command
// line and the schema, so that no page and no completion can know a word that the program does not.
#pragma once
#include <string>
#include <vector>

#include "src/app/command_line.h"

namespace firn {

// What stands on the command line where a word is wanted.
enum class Completes { nothing, choices, scene, run, run_or_scene, folder, key_value, key };
Completes completes(
    const std::string& placeholder);  // "DIR"; a placeholder that is not known is a failed Error
std::vector<std::string> choices_of(const std::string& placeholder);  // "auto|base" -> auto, base

// A key of a scene as --set takes it, with the words that it may be, where it is not a number or free text.
struct KeyWords {
  std::string name;
  std::string meaning;
  std::vector<std::string> values;
};
std::vector<KeyWords> scene_keys();

struct InstalledFolders {
  std::string scenes;
  std::string pages;
};

std::string program_page(const CommandLine& words, const InstalledFolders& folders);  // firn(1), in roff
std::string scene_page();                                                             // firn-scene(5)
std::string bash_completion(const CommandLine& words);
std::string zsh_completion(const CommandLine& words);
std::string fish_completion(const CommandLine& words);

// What they share.
std::string completing_function(Completes kind);  // of the scripts for bash and zsh, with its argument
std::string joined(const std::vector<std::string>& words, const std::string& between = " ");
std::vector<std::string> spellings(const OptionWords& option);  // "-h", "--help"
std::string replaced(std::string text, const std::string& what, const std::string& by);
std::vector<OptionWords> options_with_values(const CommandLine& words);  // each once, of all commands

}  // namespace firn
